"""What stands beside an identification on the terminal: how linear it was, and the other estimators."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from rich.text import Text

__all__ = ["comparison", "linear"]

Figure = Callable[..., str]


def linear(found: Any, figure: Figure) -> list[Any]:
    """One line: what a linear step in the fitted parameters would have promised and left."""
    if found is None:
        return []
    step, unit = found.fitted, found.unit
    words = (
        f"one linear step would promise {figure(step.promised, 3)} {unit} per axis and leave {figure(step.left, 3)} {unit}; "
        f"neglected terms {figure(step.neglected, 2)} {unit}"
    )
    return [Text(words, style="yellow" if found.misleads else "dim"), Text("")]


def comparison(found: Any, figure: Figure, table: Callable[..., Any]) -> list[Any]:
    """The estimators side by side, the models without identification below them."""
    if found is None:
        return []
    held = any(m.held_out is not None for m in found.methods)
    single = any(m.leave_one_out is not None for m in found.methods)
    columns = ["method", "after", *(["held out"] if held else []), *(["leave-one-out"] if single else [])]
    width = len(columns)
    columns += ["farthest", "sigmas", "s", "verdict", ""]
    made = table(
        *columns,
        right=(*range(1, width), width + 1, width + 2),
        title=f"Estimators on the same split, mean error [{found.unit}]",
    )

    def errors(after: Any, apart: Any, one: Any) -> Sequence[str]:
        return [figure(after), *([figure(apart)] if held else []), *([figure(one)] if single else [])]

    for m in found.methods:
        if m.failed:
            made.add_row(m.method, *[""] * (len(columns) - 2), Text(m.failed, style="yellow"))
            continue
        away = "reference" if m.method == found.reference else m.farthest
        made.add_row(
            m.method, *errors(m.after, m.held_out, m.leave_one_out), away, figure(m.sigmas, 2) if m.sigmas is not None else "",
            figure(m.seconds, 2), m.verdict.replace("_", " "), Text(m.reason if m.reason.startswith("stopped") else "", style="yellow"),
        )  # fmt: skip
    empty = [""] * 5
    made.add_row(
        "frames only", *errors(found.before, found.held_out_before, found.leave_one_out_before), *empty, style="dim"
    )
    if found.constant is not None:
        values = [
            "",
            *([figure(found.constant)] if held else []),
            *(["" if held else figure(found.constant)] if single else []),
        ]
        made.add_row("predicting the mean", *values, *empty, style="dim")
    return [made, Text("")]
