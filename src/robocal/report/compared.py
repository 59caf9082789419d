"""What stands beside an identification: terms beyond geometry that were tried, how linear the fit was, other estimators."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from robocal.report.sections import Block, Cell, Style, Text, figure, quiet, table

__all__ = ["comparison", "groups", "layer", "linear"]

ERRORS = (("after", "after"), ("held_out", "held out"), ("k_fold", "every fold"), ("leave_one_out", "leave-one-out"))
BEFORE = {
    "after": "before",
    "held_out": "held_out_before",
    "k_fold": "k_fold_before",
    "leave_one_out": "leave_one_out_before",
}


def groups(tried: Sequence[Any]) -> list[Block]:
    """A table of the groups that were tried; nothing when none was."""
    if not tried:
        return []
    unit = next((t.unit for t in tried if t.gain), "mm")
    rows: list[tuple[Cell, ...]] = []
    for t in tried:
        span = f"{figure(t.gain.low, 2)} to {figure(t.gain.high, 2)}" if t.gain else "-"
        word: Cell = ("entered", "strong") if t.entered else (t.reason, "quiet")
        rows.append(
            (t.name, str(t.parameters), figure(t.before), figure(t.gain.mean if t.gain else None, 3), span, word)
        )
    columns = (f"beyond geometry [{unit}]", "parameters", "without", "falls by", "95 % interval", "")
    note = "errors of blocks of rows in time order that were not used, groups in order of entry"
    return [table(*columns, right=(1, 2, 3, 4), rows=rows), *quiet(note)]


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
    """One line: what a linear step in the fitted parameters would have promised and left."""
    if found is None:
        return []
    step, unit = found.fitted, found.unit
    words = (
        f"one linear step would promise {figure(step.promised, 3)} {unit} per axis and leave {figure(step.left, 3)} {unit}; "
        f"neglected terms {figure(step.neglected, 2)} {unit}"
    )
    return [Text.of((words, "strange" if found.misleads else "quiet"))]


def comparison(found: Any) -> list[Block]:
    """The estimators side by side, the models without identification below them."""
    if found is None:
        return []
    keys = [(k, name) for k, name in ERRORS if any(getattr(m, k) is not None for m in found.methods)]
    columns = ("method", *(name for _, name in keys), "farthest", "sigmas", "s", "verdict", "")
    width = len(keys) + 1
    rows: list[tuple[Cell, ...]] = []
    styles: list[Style] = []
    for m in found.methods:
        styles.append("")
        if m.failed:
            rows.append((m.method, *[""] * (len(columns) - 2), (m.failed, "strange")))
            continue
        away = "reference" if m.method == found.reference else m.farthest
        sigmas = figure(m.sigmas, 2) if m.sigmas is not None else ""
        stop: Cell = (m.reason if m.stopped else "", "strange")
        errors = (figure(getattr(m, k)) for k, _ in keys)
        rows.append((m.method, *errors, away, sigmas, figure(m.seconds, 2), m.verdict.replace("_", " "), stop))
    empty = ("",) * 5
    rows.append(("frames only", *(figure(getattr(found, BEFORE[k])) for k, _ in keys), *empty))
    styles.append("quiet")
    if found.constant is not None:
        # It was predicted where the verdict looks: in the first way of holding out.
        proof = next((k for k, _ in keys if k != "after"), None)
        rows.append(("predicting the mean", *(figure(found.constant) if k == proof else "" for k, _ in keys), *empty))
        styles.append("quiet")
    title = f"Estimators on the same split, mean error [{found.unit}]"
    return [table(*columns, right=(*range(1, width), width + 1, width + 2), title=title, rows=rows, styles=styles)]
