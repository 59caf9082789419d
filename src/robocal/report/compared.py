"""What stands beside an identification: terms beyond geometry that were tried, how linear the fit was, other estimators."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from robocal.report.estimator_rows import side_by_side
from robocal.report.sections import Block, Cell, Detail, Noted, Style, Text, figure, quiet, table

__all__ = ["comparison", "groups", "layer", "linear"]

ERRORS = {"after": "after", "held_out": "held out", "k_fold": "every fold", "leave_one_out": "leave-one-out"}
Columns = Mapping[str, Sequence[object]]
SAME = "Every method had the same configurations to fit and to predict. Only errors that nothing was fitted to count."


def groups(tried: Sequence[Any]) -> list[Block]:
    """A table of the groups that were tried; nothing when none was."""
    if not tried:
        return []
    unit = next((t.unit for t in tried if t.gain), "mm")
    rows: list[tuple[Cell, ...]] = []
    for t in tried:
        span = f"{figure(t.gain.low, 2)} to {figure(t.gain.high, 2)}" if t.gain else "-"
        word: Cell = ("entered", "strong") if t.entered else (t.reason, "quiet")
        orders = "; ".join(f"{joint}: {', '.join(f'{k:g}' for k in each)}" for joint, each in t.orders.items())
        falls = figure(t.gain.mean if t.gain else None, 3)
        rows.append((t.name, str(t.parameters), figure(t.before), falls, span, word, orders))
    columns = (f"beyond geometry [{unit}]", "parameters", "without", "falls by", "95 % interval", "", "orders")
    note = "errors of blocks of rows in time order that were not used, groups in order of entry"
    caption = "A group enters when the 95 % interval of its reduction lies above zero."
    made = table(*columns, right=(1, 2, 3, 4), rows=rows, caption=caption, detail=(6,))
    return [made if any(t.orders for t in tried) else made.without((6,)), *quiet(note)]


def layer(found: Any) -> list[Block]:
    """One sentence on the residual layer; nothing when none was asked for."""
    if found is None:
        return []
    word = "switched on" if found.used else "left off"
    if found.gain is None:
        return [Text.of(f"Residual layer {word}: {found.reason}")]
    span = f"{figure(found.gain.low, 2)} to {figure(found.gain.high, 2)}"
    words = (
        f"Residual layer {word}: unseen blocks of rows {figure(found.before)} mm without it, {figure(found.after)} mm with it; "
        f"falls by {figure(found.gain.mean, 3)} mm, 95 % interval {span}"
    )
    return [Text.of((words, "strong" if found.used else ""))]


def linear(found: Any) -> list[Block]:
    """One line: what a linear step in the fitted parameters would have promised and left; on pages its whole story."""
    if found is None:
        return []
    step, unit = found.fitted, found.unit
    words = (
        f"one linear step would promise {figure(step.promised, 3)} {unit} per axis and leave {figure(step.left, 3)} {unit}; "
        f"neglected terms {figure(step.neglected, 2)} {unit}"
    )
    return [Text.of((words, "strange" if found.misleads else "quiet")), Detail(lambda: _steps(found))]


def _steps(found: Any) -> Iterator[Block]:
    """Linear steps from the start, and how much the solution bends."""
    yield Text.of(
        "A linear step trusts the derivatives at the start. What it neglects are the terms of second order and beyond; where they "
        "are larger than what is left, one step misleads."
    )
    steps = (("the fitted parameters", found.fitted), ("everything that is free, without priors", found.everything))
    columns = ("before", "promised", "left", "neglected")
    rows = [(name, *(figure(getattr(s, k), 3) for k in columns)) for name, s in steps if s is not None]
    caption = f"One linear step from the start, rms per axis, in {found.unit}"
    yield table("step in", *columns, right=(1, 2, 3, 4), rows=rows, caption=caption)
    enough = "In the fitted parameters one step would nearly have done."
    said = "One step would have misled; the iteration was needed." if found.misleads else enough
    if found.ruins:
        said += " One step in everything that is free would have made it worse than before."
    along = f", along {found.curvature_parameter}" if found.curvature_parameter else ""
    bend = (
        f" Curvature within one standard deviation of the solution: {figure(found.curvature, 2)}{along}; below about 1 the "
        "sigmas may be trusted."
    )
    yield Text.of(said, ("" if found.curvature is None else bend, "quiet"))


def comparison(found: Any, rows: Columns | None = None) -> list[Block]:
    """The estimators side by side, the models without identification below them; on pages what they leave of every row, of which `rows`
    are the columns of comparison.csv."""
    if found is None:
        return []
    keys = [k for k in ERRORS if any(getattr(m, k) is not None for m in found.methods)]
    columns = ("method", *(ERRORS[k] for k in keys), "farthest", "sigmas", "s", "verdict", "")
    width = len(keys) + 1
    cells: list[tuple[Cell, ...]] = []
    for m in found.methods:
        if m.failed:
            cells.append((Noted(m.method, m.title), *[""] * (len(columns) - 2), (m.failed, "strange")))
            continue
        away = "reference" if m.method == found.reference else m.farthest
        sigmas, seconds = figure(m.sigmas, 2) if m.sigmas is not None else "", figure(m.seconds, 2)
        stop: Cell = (m.reason if m.stopped else "", "strange")
        errors = (figure(getattr(m, k)) for k in keys)
        cells.append((Noted(m.method, m.title), *errors, away, sigmas, seconds, m.verdict.replace("_", " "), stop))
    empty = ("",) * 5
    before = (getattr(found, "before" if k == "after" else f"{k}_before") for k in keys)
    cells.append(("frames only", *map(figure, before), *empty))
    if found.constant is not None:
        # It was predicted where the verdict looks: in the first way of holding out.
        proof = next((k for k in keys if k != "after"), None)
        cells.append(("predicting the mean", *(figure(found.constant) if k == proof else "" for k in keys), *empty))
    styles: list[Style] = ["" if i < len(found.methods) else "quiet" for i in range(len(cells))]
    title = f"Estimators on the same split, mean error [{found.unit}]"
    right = (*range(1, width), width + 1, width + 2)
    made = table(*columns, right=right, title=title, rows=cells, styles=styles, caption=SAME)
    return [made, Detail(lambda: [side_by_side(rows) if rows else None])]
