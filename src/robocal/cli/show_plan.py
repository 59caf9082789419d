"""The verb `plan` on the terminal: what so many poses will be worth."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from robocal.cli.show import figure, show_paths, show_warnings, table
from robocal.cli.terminal import Terminal

if TYPE_CHECKING:
    from robocal.jobs.plan import Planned

__all__ = ["show_plan"]


def show_plan(terminal: Terminal, made: Planned, robot: str) -> None:
    """Accuracy against the number of poses, and what to do next."""
    if terminal.json:
        for warning in made.warnings:
            terminal.warn(warning)
        return
    found = made.document
    n = found["poses"]
    terminal.show(
        Text.assemble(
            (found["robot"], "bold"),
            f"   {n} poses of {found['candidates']} candidates, kind {found['kind']}, criterion {found['criterion']}",
        )
    )
    if found["measured_before"]:
        terminal.show(Text(f"{found['measured_before']} poses were measured before and count", style="dim"))
    made_table = table(
        "poses",
        "mean",
        "95 %",
        "random",
        "last pose",
        right=(0, 1, 2, 3, 4),
        title="Foretold error [mm] at other poses",
    )
    for row in found["forecast"]:
        k = row["poses"]
        if k == n or (k and k % 5 == 0):
            gain = "" if row["gain_mm"] is None else f"-{figure(row['gain_mm'], 2)}"
            cells = (str(k), figure(row["mean_mm"]), figure(row["p95_mm"]), figure(row["random_mm"]), gain)
            made_table.add_row(*cells, style="bold" if k == n else "")
    terminal.show(Text(""), made_table)
    low, high = min(found["perturbed_models_mm"]), max(found["perturbed_models_mm"])
    terminal.show(Text(f"at models that are off as far as expected: {figure(low)} to {figure(high)} mm", style="dim"))
    value, limit = found["selection"]["value"], found["selection"]["limit"]
    if found["criterion"] == "I" and limit:
        more = 100 * ((value / limit) ** 0.5 - 1)
        # Fewer poses than unknowns leave the limit so far away that it says nothing.
        if more < 100:
            terminal.show(Text(f"no {n} of these candidates are better by more than {figure(more, 2)} %", style="dim"))
    enough = found["enough"]
    if found["asked_accuracy_mm"] is not None:
        words = f"{enough} poses reach {figure(found['asked_accuracy_mm'])} mm" if enough else ""
    else:
        words = f"{enough} poses are enough: five more gain less than 5 %" if enough else "more poses still help"
    if words:
        terminal.show(Text(words, style="bold"))
    terminal.show(Text(""))
    show_warnings(terminal, made.warnings)
    show_paths(terminal, made.written)
    ready = next((p for p in made.written if p.name == "data.yaml"), None)
    if ready is not None:
        terminal.say(f"Next: measure, fill in {ready.with_suffix('.csv')}, then robocal identify {robot} {ready}")
