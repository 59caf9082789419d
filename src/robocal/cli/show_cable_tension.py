"""Cable robots on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from rich.text import Text

from robocal.cli.show import figure, show_paths, table
from robocal.cli.terminal import Terminal

if TYPE_CHECKING:
    from robocal.jobs.cable.tension_result import Tensions

__all__ = ["show_tension"]


def show_tension(terminal: Terminal, made: Tensions) -> None:
    """How many poses are held, what each cable bears, and the pose with the least to spare."""
    spread = made.spread
    k, held = len(made.names), int(spread.feasible.sum())
    head = f"   {held} of {k} poses are held, method {spread.method}, {figure(made.mass)} kg"
    terminal.show(Text.assemble((made.robot.name, "bold"), head))
    if spread.found.any():
        shown = table("tension [N]", "least", "mean", "greatest", "limits", right=(1, 2, 3, 4))
        for cable, t, (low, high) in zip(made.robot.cables, spread.tension[spread.found].T, spread.limits, strict=True):
            shown.add_row(cable, *(figure(float(v)) for v in (t.min(), t.mean(), t.max())), f"{low:g} to {high:g}")
        terminal.show(Text(""), shown)
    if k:
        worst = int(np.argmin(made.margin))
        terminal.show(Text(f"the least margin is {figure(float(made.margin[worst]))} N, at {made.names[worst]}"))
    show_paths(terminal, made.written)
