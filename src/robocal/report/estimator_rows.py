"""Estimators side by side as a picture: what each leaves of every row of the measurements, component by component."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.report import svg
from robocal.report.numbers import significant, unit_text, with_unit
from robocal.report.sections import Figure, Mark
from robocal.report.series import is_held_out, numbers, ordinals
from robocal.report.svg import AxisScale, drawing, label, line, points

__all__ = ["side_by_side"]

Columns = Mapping[str, Sequence[object]]
WORDS = ("configuration", "set", "group", "kind", "target", "component", "unit")
MOST = 8  # components
ROWS = 120  # marks of a panel: it is hardly wider in px
WIDTH, HIGH, LEFT, HEAD, GAP, FOOT = 940.0, 84.0, 70.0, 44.0, 30.0, 40.0
FAR = 5.0  # times the error of the best: who leaves more does not decide the scale
TITLE = "What each leaves, by component and configuration"
MARKS: tuple[tuple[Mark, str], ...] = (
    ("after", "seen by the fit"),
    ("held", "held out"),
    ("aside", "beyond the scale"),
)


def side_by_side(columns: Columns) -> Figure | None:
    """A panel for each component (down) and estimator (across): signed errors over the configurations, from the columns of
    comparison.csv; None where there are none."""
    methods = [name for name in columns if name not in WORDS]
    said = [f"{c}\0{u}" for c, u in zip(columns["component"], columns["unit"], strict=True)]
    shown = list(dict.fromkeys(said))[:MOST]
    if not methods or not shown:
        return None
    values, held, places = {m: numbers(columns, m) for m in methods}, is_held_out(columns), ordinals(columns)
    last = int(places.max())
    each = (WIDTH - LEFT) / len(methods)
    parts, told, marks, most = [], [], set[str](), 0
    for row, name in enumerate(shown):
        own = np.array([s == name for s in said])
        errors = [values[m][own] for m in methods]
        rms = [float(np.sqrt(np.mean(e[np.isfinite(e)] ** 2))) if np.isfinite(e).any() else np.inf for e in errors]
        fair = [e for e, r in zip(errors, rms, strict=True) if r <= FAR * min(rms)]
        reach = 1.1 * max((float(np.nanmax(np.abs(e))) for e in fair), default=0.0) or 1.0
        component, unit = name.split("\0")
        top, most = HEAD + row * (HIGH + GAP), max(most, int(own.sum()))
        y = AxisScale(-reach, reach, top + HIGH, top)
        parts.append(label(4, top - 8, ", ".join(t for t in (component, unit_text(unit)) if t), "strong"))
        for column, (m, e, r) in enumerate(zip(methods, errors, rms, strict=True)):
            left = LEFT + column * each
            x = AxisScale(0.5, last + 0.5, left, left + each - 14)
            parts += _grid(y, x, column == 0)
            drawn, kinds = _marks(x, y, places[own], e, held[own])
            parts.append(drawn)
            marks |= kinds
            size = with_unit(significant(r, 2), unit)
            parts.append(label(x.end, top - 8, f"rms {size}", "tick", "end"))
            told.append(f"{m}, {component}: rms {size}")
            if row == 0:
                parts.append(label(left, top - 26, m, "strong"))
            if row == len(shown) - 1:
                ticks = [t for t in svg.nice_ticks(1, max(last, 2), 3) if 1 <= t <= last]
                parts.append(svg.count_axis(x, ticks, y.start, (left, x.end), "configuration"))
    height = HEAD + len(shown) * (HIGH + GAP) - GAP + FOOT
    made = drawing(WIDTH, height, parts, title=TITLE, text=f"{'; '.join(told)}.", key="estimators", cls="wide")
    thin = f" Of {most} errors some are drawn, at even steps." if most > ROWS else ""
    caption = f"Signed errors, in the axes of the instrument, on one scale in each line; numbers: comparison.csv.{thin}"
    return Figure(made, caption, TITLE, tuple((key, word) for key, word in MARKS if key in marks))


def _grid(y: AxisScale, x: AxisScale, first: bool) -> list[str]:
    parts = [line(x.start, y.start, x.end, y.start, "axis"), line(x.start, y(0.0), x.end, y(0.0), "mid")]
    for t in svg.nice_ticks(y.low, y.high, 3):
        parts.append(line(x.start, y(t), x.end, y(t), "grid"))
        if first:
            parts.append(label(x.start - 6, y(t) + 4, svg.tick_text(t), "tick", "end"))
    return parts


def _marks(x: AxisScale, y: AxisScale, places: Ints, errors: Array, held: Bools) -> tuple[str, set[str]]:
    """The marks of a panel, and which of them it has."""
    some = np.flatnonzero(np.isfinite(errors))
    some = some[:: max(1, -(-len(some) // ROWS))]
    far = np.abs(errors[some]) > y.high
    at = np.stack([x.many(places[some]), y.many(np.clip(errors[some], y.low, y.high))], axis=1)
    kinds = {"after": ~held[some] & ~far, "held": held[some] & ~far, "aside": far}
    return "".join(points(at[k].tolist(), key) for key, k in kinds.items() if k.any()), {
        key for key, k in kinds.items() if k.any()
    }
