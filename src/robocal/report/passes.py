"""How a fit came about, as pictures: every parameter over its passes, of a filter also over the measurements, a panel for each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.report import svg
from robocal.report.numbers import significant, with_unit
from robocal.report.parameter_tables import change_text
from robocal.report.sections import Figure
from robocal.report.svg import AxisScale, drawing, label, line, path, points, polyline

__all__ = ["PANELS", "over_measurements", "over_passes"]

PANELS, ACROSS = 12, 3  # of a picture, and side by side
WIDTH, EACH, HIGH, HEAD, LEFT, FOOT = 940.0, 312.0, 76.0, 46.0, 54.0, 44.0
ROOM = 28  # letters above a panel
DOTS = 30  # points of a line: more would be a line as well


def over_passes(result: Any) -> Figure | None:
    """The parameters that moved most, after each pass; None where nobody kept them."""
    title = "Parameters over the passes"
    told = "Change from nominal after each pass; each panel has a scale of its own. A line that is level at its end has settled."
    return _figure(result, result.fit.passes, title, told, "passes", "pass")


def over_measurements(result: Any) -> Figure | None:
    """The same after each configuration that a filter took in, with bands; None of what is no filter."""
    title = "Parameters over the measurements"
    told = (
        "Change from nominal as the filter takes in one configuration after the other, in its own 95 % band (grey). At the end, "
        "the result with its interval: outside of the band, the filter linearised too far from it."
    )
    return _figure(result, result.fit.filter, title, told, "filter-rows", "configurations taken in")


def _figure(result: Any, found: Any, title: str, told: str, key: str, what: str) -> Figure | None:
    if found is None or len(found.after) < 2:
        return None
    ended = {p.name: p for p in result.parameters if p.delta is not None}
    known = [(p, ended[p.name]) for p in found.parameters if p.name in ended and _is_whole(p, len(found.after))]
    # In errors that were expected: mm and deg cannot be compared.
    known.sort(key=lambda both: -abs(both[1].delta) / (both[1].expected or np.inf))
    chosen, parts = known[:PANELS], []
    for i, (p, end) in enumerate(chosen):
        row, column = divmod(i, ACROSS)
        left, top = column * EACH + LEFT, row * (HIGH + HEAD) + HEAD - 16
        x = AxisScale(found.after[0], found.after[-1], left + 6, left + EACH - LEFT - 14)
        parts += _panel(p, end, found.after, x, top)
        if i + ACROSS >= len(chosen):  # the lowest of its column
            ticks = [t for t in svg.nice_ticks(x.low, x.high, 4) if t == int(t)]
            parts.append(svg.count_axis(x, ticks, top + HIGH, (left, x.end + 6), what))
    if not chosen:
        return None
    rows = -(-len(chosen) // ACROSS)
    said = "; ".join(f"{p.name} ends at {change_text(end)}" for p, end in chosen)
    made = drawing(WIDTH, rows * (HIGH + HEAD) + FOOT, parts, title=title, text=f"{said}.", key=key, cls="wide")
    more = f" Of {len(known)} parameters the {PANELS} that moved most are drawn; result.json has all."
    return Figure(made, told + (more if len(known) > PANELS else ""), title)


def _is_whole(p: Any, count: int) -> bool:
    """Whether there are as many numbers as passes: a result.json may come from anybody."""
    return len(p.change) == count and len(p.band) in (0, count) and all(map(math.isfinite, (*p.change, *p.band)))


def _panel(p: Any, end: Any, after: Sequence[int], x: AxisScale, top: float) -> list[str]:
    change, band = np.array(p.change), np.array(p.band)
    y = AxisScale(*_range(change, _ends(end) if len(band) else []), top + HIGH, top)
    left, right, across = x.start - 6, x.end + 6, x.many(after).tolist()
    told = change_text(end)
    if len(p.name) + len(told) > ROOM:
        told = with_unit(significant(end.delta), end.unit)
    parts = [label(left, top - 10, p.name, "name"), label(right, top - 10, told, "strong", "end")]
    if len(band):
        upper, lower = (y.many(np.clip(change + s * band, y.low, y.high)).tolist() for s in (1, -1))
        edge = [*zip(across, upper, strict=True), *zip(across[::-1], lower[::-1], strict=True)]
        parts.append(path(polyline(edge, closed=True), "expected"))
    ticks = svg.nice_ticks(y.low, y.high, 3)
    for t, height in zip(ticks, y.many(ticks).tolist(), strict=True):
        parts += [
            line(left, height, right, height, "grid"),
            label(left - 6, height + 4, svg.tick_text(t), "tick", "end"),
        ]
    parts.append(line(left, top + HIGH, right, top + HIGH, "axis"))
    places = [*zip(across, y.many(change).tolist(), strict=True)]
    parts.append(path(polyline(places), "curve"))
    if len(places) <= DOTS:
        parts.append(points(places, "after"))
    if len(band):
        low, high = (y(v) for v in _ends(end))
        parts += [line(x.end, low, x.end, high, "bar-line"), points([(x.end, y(end.delta))], "held")]
    return parts


def _ends(end: Any) -> list[float]:
    """The interval of a change as it is told."""
    low, high = end.interval or (None, None)
    half = 0.0 if low is None or high is None else (high - low) / 2
    return [end.delta - half, end.delta + half]


def _range(change: Array, ends: Sequence[float]) -> tuple[float, float]:
    """What a panel shows: every value, nominal, and the interval at the end; some air. Bands go beyond."""
    every = [0.0, *change.tolist(), *ends]
    low, high = min(every), max(every)
    air = 0.08 * (high - low) or 1.0
    return low - air, high + air
