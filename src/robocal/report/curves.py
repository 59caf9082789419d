"""Curves over an angle: lines and dots of several series in one plot."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.report.svg import AxisScale, axes, drawing, path, points, polyline

__all__ = ["AngleCurve", "draw_curves", "figure_of"]

WIDE, HIGH, LEFT, FOOT, TOP = 760.0, 300.0, 60.0, 44.0, 30.0
MOST = 1500  # grid: points of a series: more would be no more to see
AIR = 0.05  # grid: of the range, above and below


@record(eq=False)
class AngleCurve:
    """One series: x and y (n,), drawn as a line of a class, or as marks of a series (`dots`); NaN interrupts it."""

    x: Array
    y: Array
    cls: str = "curve"
    dots: str = ""


def draw_curves(
    curves: Sequence[AngleCurve],
    across: str,
    up: str,
    *,
    title: str,
    text: str,
    key: str,
    ends: tuple[float, float] | None = None,
) -> str:
    """All series in one plot, between these `ends` of the axis across; else between those of the series."""
    known = [c for c in curves if np.isfinite(c.y).any()]
    x_all, y_all = (np.concatenate([v[np.isfinite(c.y)] for c in known for v in (getattr(c, n),)]) for n in ("x", "y"))
    low, high = float(y_all.min()), float(y_all.max())
    air = AIR * (high - low) or 1.0
    first, last = ends or (float(x_all.min()), float(x_all.max()))
    x = AxisScale(first, last, LEFT, WIDE - 12)
    y = AxisScale(low - air, high + air, HIGH - FOOT, TOP)
    parts = [axes(x, y, across, up)]
    for c in known:
        step = -(-len(c.x) // MOST)
        at, value = c.x[::step], c.y[::step]
        seen = np.isfinite(value)
        places = np.column_stack([x.many(at), y.many(np.where(seen, value, 0.0))])
        if c.dots:
            parts.append(points(places[seen].tolist(), c.dots))
            continue
        edges = np.flatnonzero(np.diff(np.concatenate([[False], seen, [False]]).astype(np.int8)))
        lines = (polyline(places[a:b].tolist()) for a, b in zip(edges[::2], edges[1::2], strict=True))
        parts.append(path("".join(lines), c.cls))
    return drawing(WIDE, HIGH, parts, title=title, text=text, key=key, cls="wide")


def figure_of(number: int) -> str:
    """What a caption says of the figure of the seed document's chapter 1 that it is."""
    return f"(Figure 1.{number} of the document.)"
