"""Errors where they were measured: a coloured dot at every place, in the plane of the places or in layers of a volume.

Places lie in a plane where they extend across it by at most FLAT of their second extent: it is then seen along the axis of the base
that is nearest to its normal. A volume is cut into LAYERS layers of one height, each seen from above.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from robocal._record import record
from robocal._types import Array, Ints
from robocal.report.heat import COLOURS, WIDTH, colour_bar, colour_scale, colour_steps
from robocal.report.numbers import significant, with_unit
from robocal.report.svg import AxisScale, drawing, label, line, nice_ticks, num, tick_text

__all__ = ["ErrorMap", "error_map", "mean_by_place"]

FEWEST = 4  # places; fewer are said by the table
FLAT = 0.05  # grid: 18 mm in 360
LAYERS = 3
MOST = 5000  # dots of a picture
DENSE = 6.0  # px between dots; below it they touch
DECADES = 1.5  # of a scale of colours: what is smaller has the first colour
WIDEST, PLANE, LAYER = WIDTH, 400.0, 230.0  # px, the room of a panel across and up
LEFT, TOP, BELOW, GAP = 58.0, 66.0, 44.0, 36.0
VIEWS = ((1, 2), (0, 2), (0, 1))  # the axes that are seen along each


@record(eq=False)
class ErrorMap:
    """Places (k, 3) mm, the axis of the base along which they are seen, the layer of each (k,), and the ends of every layer, mm."""

    at: Array
    along: int
    layer: Ints
    ends: Array

    @classmethod
    def of(cls, at: Array) -> ErrorMap:
        """One layer of places in a plane, else LAYERS from below to above."""
        _, size, axes = np.linalg.svd(at - at.mean(axis=0), full_matrices=False)
        flat = size[2] <= FLAT * size[1]
        along = int(np.abs(axes[2]).argmax()) if flat and size[1] > 0 else 2
        ends = np.linspace(at[:, along].min(), at[:, along].max(), 2 if flat else LAYERS + 1)
        layer = np.clip(np.searchsorted(ends, at[:, along], side="right") - 1, 0, len(ends) - 2)
        return cls(at, along, layer, ends)

    def picture(self, errors: Array, key: str, title: str) -> str:
        """The errors (k,) mm at the places, as SVG."""
        scale, parts, y = colour_scale(errors, DECADES), [], TOP
        parts.append(colour_bar(scale, LEFT))
        # More would hide one another; the largest is among those that are drawn.
        drawn = np.arange(len(errors)) % -(-len(errors) // MOST) == 0
        drawn[errors.argmax()] = True
        for k in range(len(self.ends) - 1):
            mine = drawn & (self.layer == k)
            panel, y = self._panel(self.at[mine], errors[mine], scale, y, k)
            parts.append(panel)
        worst = ", ".join(f"{a} {v:.0f}" for a, v in zip("xyz", self.at[errors.argmax()], strict=True))
        said = (
            f"{len(errors)} places; mean error {with_unit(significant(float(errors.mean())), 'mm')}, "
            f"largest {with_unit(significant(float(errors.max())), 'mm')} at {worst} mm."
        )
        return drawing(LEFT + WIDTH + 16, y - GAP, parts, title=title, text=said, key=key)

    def _panel(self, at: Array, errors: Array, scale: AxisScale, top: float, k: int) -> tuple[str, float]:
        """One layer below `top`, and where the next one begins."""
        u, v = VIEWS[self.along]
        low, high = self.at.min(axis=0), self.at.max(axis=0)
        size = np.maximum(high - low, 1e-6 * max(float((high - low).max()), 1.0))
        turned = size[v] > 1.3 * size[u]  # what is long lies across: seen from above with x up, y goes left
        across, up = (v, u) if turned else (u, v)
        room = PLANE if len(self.ends) == 2 else LAYER
        factor = min(WIDEST / size[across], room / size[up])
        wide, tall = factor * size[across], factor * size[up]
        left, right = LEFT + (WIDTH - wide) / 2, LEFT + (WIDTH + wide) / 2
        x = AxisScale(low[across], high[across], *((right, left) if turned else (left, right)))
        y = AxisScale(low[up], high[up], top + tall, top)
        spacing = math.sqrt(wide * tall / max(len(at), 1))
        dense = spacing < DENSE
        radius = max(0.6 * spacing, 1.3) if dense else min(0.47 * spacing, 5.0)
        parts = [_frame(x, y, radius)]
        dots = [f"M{num(a)} {num(b)}h0" for a, b in zip(x.many(at[:, across]), y.many(at[:, up]), strict=True)]
        if not dense:  # on either paper some colours are faint
            parts.append(_dots(dots, 2 * radius + 1.2, 'class="dots edge"'))
        steps = colour_steps(scale, errors)
        for step in np.unique(steps).tolist():  # the largest lie above
            some = [dots[i] for i in np.flatnonzero(steps == step)]
            parts.append(_dots(some, 2 * radius, f'class="dots" stroke="{COLOURS[step]}"'))
        middle, foot = (x.start + x.end) / 2, top + tall + radius
        names = f"{'xyz'[across]} {'to the left' if turned else 'to the right'}, {'xyz'[up]} up, mm"
        bottom, above = self.ends[k : k + 2]
        axis = "xyz"[self.along]
        one = f"{axis} = {bottom:.0f} mm" if above - bottom < 1 else f"{axis} from {bottom:.0f} to {above:.0f} mm"
        count = int((self.layer == k).sum())
        parts.append(label(LEFT + WIDTH / 2, top - radius - 10, f"{one}: {count} places", "strong", "middle"))
        parts.append(label(middle, foot + 36, names, "axis-title", "middle"))
        return "".join(parts), foot + BELOW + GAP


def _frame(x: AxisScale, y: AxisScale, air: float) -> str:
    """Axes around dots, with some air."""
    left, right = min(x.start, x.end) - air - 3, max(x.start, x.end) + air + 3
    bottom, top = y.start + air + 3, y.end - air - 3
    parts = [line(left, bottom, right, bottom, "axis"), line(left, bottom, left, top, "axis")]
    for t in nice_ticks(x.low, x.high, 4):
        parts.append(line(x(t), bottom, x(t), bottom + 4, "axis"))
        parts.append(label(x(t), bottom + 17, tick_text(t), "tick", "middle"))
    for t in nice_ticks(y.low, y.high, 4):
        parts.append(line(left - 4, y(t), left, y(t), "axis"))
        parts.append(label(left - 7, y(t) + 4, tick_text(t), "tick", "end"))
    return "".join(parts)


def _dots(dots: Sequence[str], width: float, how: str) -> str:
    return f'<path {how} stroke-width="{num(width)}" d="{"".join(dots)}"/>'


def mean_by_place(at: Array, *errors: Array) -> tuple[Array, ...]:
    """Places (k, 3) mm, each once, and the mean of errors (n,) at each, of rows at (n, 3) that have a place; rows of one place agree
    to a thousandth of a millimetre."""
    known = np.isfinite(np.column_stack([at, *errors])).all(axis=1)
    _, first, row = np.unique(np.round(at[known], 3), axis=0, return_index=True, return_inverse=True)
    count = np.bincount(row.ravel(), minlength=len(first))
    return at[known][first], *(np.bincount(row.ravel(), e[known], len(first)) / count for e in errors)


def error_map(at: Array) -> ErrorMap | None:
    """The map of places (k, 3) mm; None of too few."""
    return ErrorMap.of(at) if len(at) >= FEWEST else None
