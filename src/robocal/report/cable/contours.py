"""Lines of equal error over two noises: figures C.1 to C.6 of the thesis behind `examples/cable-laval`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array
from robocal.report.svg import AxisScale, axes, drawing, label, line, path, polyline

__all__ = ["contours"]

WIDTH, HEIGHT, LEFT, RIGHT, BOTTOM, HEAD = 400.0, 330.0, 58.0, 376.0, 276.0, 40.0
AIR = 1.12


def contours(curves: Sequence[tuple[str, Array]], titles: tuple[str, str], said: str, key: str) -> str:
    """A picture (SVG): each curve (n, 2) with what stands on it, from the smallest error to the largest."""
    across, up = titles
    most = np.max([c.max(axis=0) for _, c in curves], axis=0) * AIR
    x, y = AxisScale(0, float(most[0]), LEFT, RIGHT), AxisScale(0, float(most[1]), BOTTOM, HEAD)
    parts = [axes(x, y, across, up), line(LEFT, BOTTOM, LEFT, HEAD, "axis")]
    for name, curve in curves:
        at = [(x(a), y(b)) for a, b in curve.tolist()]
        right, top = at[len(at) // 2]
        parts += [path(polyline(at), "curve"), label(right + 4, top - 5, name, "tick")]
    return drawing(WIDTH, HEIGHT, parts, title=f"{across} and {up}", text=said, key=key)
