"""What is handed on, on the terminal: compensated targets."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from robocal.cli.show import figure, show_paths, table
from robocal.cli.terminal import Terminal

if TYPE_CHECKING:
    from robocal.jobs.compensate import Compensated

__all__ = ["show_compensation"]
MOST = 10


def show_compensation(terminal: Terminal, found: Compensated) -> None:
    """Errors before and after, targets by status, and those that need a look."""
    counts = ", ".join(f"{n} {word}" for word, n in found.counts.items() if n)
    terminal.show(Text.assemble((found.robot.name, "bold"), f"   {len(found.file.ids)} targets: {counts}"))
    made = table("simulated error [mm]", "mean", "rms", "95 %", "max", "n", right=(1, 2, 3, 4, 5))
    stages = (
        ("not compensated", found.before),
        ("corrected joint values", found.after),
        ("corrected Cartesian targets", found.after_by_tcp),
    )
    for label, s in stages:
        if s is not None:
            made.add_row(label, figure(s.mean), figure(s.rms), figure(s.p95), figure(s.max), str(s.n))
    terminal.show(Text(""), made, Text("if the calibrated model is the truth", style="dim"))
    real = found.document["expected_of_the_real_robot"]
    if real:
        mean, worst = figure(real["mean"], 3), figure(real["max"], 3)
        told = f"the real robot is expected within {mean} mm (95 %, mean of the targets; worst {worst} mm)"
        terminal.show(Text(told))
    # What has no correction comes first.
    order = sorted((i for i, note in enumerate(found.notes) if note), key=lambda i: -int(found.made.status[i]))
    words = list(found.counts)
    if order:
        rows = table("target", "status", "")
        for i in order[:MOST]:
            rows.add_row(found.file.ids[i], words[int(found.made.status[i])], str(found.notes[i]))
        terminal.show(Text(""), rows)
        if len(order) > MOST:
            terminal.show(Text(f"and {len(order) - MOST} others in compensated.csv", style="dim"))
    show_paths(terminal, found.written)
