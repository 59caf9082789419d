"""Lines of equal error over two noises: figures C.1 to C.6 of the thesis behind `examples/cable-laval`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array
from robocal.report.svg import AxisScale, bottom_axis, drawing, label, left_axis, line, num, path

__all__ = ["contours"]

WIDTH, HEIGHT, LEFT, RIGHT, BOTTOM, HEAD = 400.0, 330.0, 58.0, 376.0, 276.0, 40.0
AIR = 1.12


def contours(curves: Sequence[tuple[str, Array]], axes: tuple[str, str], said: str, key: str) -> str:
    """A picture (SVG): each curve (n, 2) with what stands on it, from the smallest error to the largest."""
    most = np.max([c.max(axis=0) for _, c in curves], axis=0) * AIR
    x, y = AxisScale(0, float(most[0]), LEFT, RIGHT), AxisScale(0, float(most[1]), BOTTOM, HEAD)
    parts = [
        bottom_axis(x, BOTTOM, HEAD, axes[0]),
        left_axis(y, LEFT, RIGHT, axes[1]),
        line(LEFT, BOTTOM, LEFT, HEAD, "axis"),
    ]
    for name, curve in curves:
        at = [(x(float(a)), y(float(b))) for a, b in curve]
        parts.append(path("M" + "L".join(f"{num(a)} {num(b)}" for a, b in at), "curve"))
        middle = at[len(at) // 2]
        parts.append(label(middle[0] + 4, middle[1] - 5, name, "tick"))
    return drawing(WIDTH, HEIGHT, parts, title=f"{axes[0]} and {axes[1]}", text=said, key=key)
