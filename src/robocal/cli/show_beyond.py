"""What lies beyond geometry on the terminal: groups that were tried, and the residual layer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rich.text import Text

__all__ = ["groups", "layer"]


def groups(tried: list[Any], figure: Callable[..., str], table: Callable[..., Any]) -> list[Any]:
    """A table of the groups that were tried; nothing when none was."""
    if not tried:
        return []
    unit = next((t.unit for t in tried if t.gain), "mm")
    made = table(
        f"beyond geometry [{unit}]", "parameters", "without", "falls by", "95 % interval", "", right=(1, 2, 3, 4)
    )
    for t in tried:
        gain = t.gain
        span = f"{figure(gain.low, 2)} to {figure(gain.high, 2)}" if gain else "-"
        made.add_row(
            t.name, str(t.parameters), figure(t.before), figure(gain.mean if gain else None, 3), span,
            Text("entered" if t.entered else t.reason, style="bold" if t.entered else "dim"),
        )  # fmt: skip
    return [
        made,
        Text("errors of blocks of rows in time order that were not used, groups in order of entry", style="dim"),
        Text(""),
    ]


def layer(found: Any, figure: Callable[..., str]) -> list[Any]:
    """One sentence on the residual layer; nothing when none was asked for."""
    if found is None:
        return []
    word = "switched on" if found.used else "left off"
    if found.gain is None:
        return [Text(f"Residual layer {word}: {found.reason}"), Text("")]
    span = f"{figure(found.gain.low, 2)} to {figure(found.gain.high, 2)}"
    words = (
        f"Residual layer {word}: unseen blocks of rows {figure(found.before)} mm without it, {figure(found.after)} mm with it; "
        f"falls by {figure(found.gain.mean, 3)} mm, 95 % interval {span}"
    )
    return [Text(words, style="bold" if found.used else ""), Text("")]
