"""What stands beside an identification on the terminal: how linear it was, and the other estimators."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rich.text import Text

__all__ = ["comparison", "linear"]

Figure = Callable[..., str]
ERRORS = (("after", "after"), ("held_out", "held out"), ("k_fold", "every fold"), ("leave_one_out", "leave-one-out"))
BEFORE = {
    "after": "before",
    "held_out": "held_out_before",
    "k_fold": "k_fold_before",
    "leave_one_out": "leave_one_out_before",
}


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
    keys = [(k, name) for k, name in ERRORS if any(getattr(m, k) is not None for m in found.methods)]
    columns = ["method", *(name for _, name in keys), "farthest", "sigmas", "s", "verdict", ""]
    width = len(keys) + 1
    title = f"Estimators on the same split, mean error [{found.unit}]"
    made = table(*columns, right=(*range(1, width), width + 1, width + 2), title=title)

    for m in found.methods:
        if m.failed:
            made.add_row(m.method, *[""] * (len(columns) - 2), Text(m.failed, style="yellow"))
            continue
        away = "reference" if m.method == found.reference else m.farthest
        made.add_row(
            m.method, *(figure(getattr(m, k)) for k, _ in keys), away, figure(m.sigmas, 2) if m.sigmas is not None else "",
            figure(m.seconds, 2), m.verdict.replace("_", " "), Text(m.reason if m.stopped else "", style="yellow"),
        )  # fmt: skip
    empty = [""] * 5
    made.add_row("frames only", *(figure(getattr(found, BEFORE[k])) for k, _ in keys), *empty, style="dim")
    if found.constant is not None:
        # It was predicted where the verdict looks: in the first way of holding out.
        proof = next((k for k, _ in keys if k != "after"), None)
        made.add_row(
            "predicting the mean", *(figure(found.constant) if k == proof else "" for k, _ in keys), *empty, style="dim"
        )
    return [made, Text("")]
