"""The verb `cable poses` on the terminal."""

from __future__ import annotations

from rich.text import Text

from robocal.cli.show import figure, show_paths, table
from robocal.cli.terminal import Terminal
from robocal.jobs.cable.poses_result import EXPECTED_OF, STOPPED_BY, Listed

__all__ = ["show_poses", "summary"]


def summary(made: Listed) -> str:
    """One line on the whole list."""
    stopped = ", ".join(f"{STOPPED_BY[name]} {count}" for name, count in made.limits.items() if count)
    return f"{len(made.names)} poses, {figure(100 * made.listing.reached)} % of the box Z reached; stopped by {stopped}"


def show_poses(terminal: Terminal, made: Listed) -> None:
    """What stopped the motions, where they start, and what the choice is worth."""
    n = len(made.names)
    head = f"   {n} poses, {figure(100 * made.listing.reached)} % of the box Z reached, mu {made.margin:g}"
    terminal.show(Text.assemble((made.robot.name, "bold"), head))
    k, l = made.start.nearest
    if k >= 0:
        pair = f"{made.robot.cables[k]} and {made.robot.cables[l]} pass with {figure(1e3 * made.start.gap)} mm between them"
        terminal.show(Text(f"at X_0 {pair}; capacity margin {figure(made.start.margin)} N", style="dim"))
    stopped = table("stopped by", "motions", "share [%]", right=(1, 2))
    for name, count in made.limits.items():
        stopped.add_row(STOPPED_BY[name], str(count), f"{100 * count / n:.1f}")
    terminal.show(Text(""), stopped)
    if made.choice is not None:
        _show_choice(terminal, made)
    show_paths(terminal, made.written)


def _show_choice(terminal: Terminal, made: Listed) -> None:
    choice = made.choice
    assert choice is not None
    count = len(choice.chosen)
    shown = table(
        "expected rms [mm]",
        f"{count} chosen",
        f"{count} at random",
        f"all {len(made.names)}",
        right=(1, 2, 3),
    )
    for what in choice.expected["chosen"]:
        cells = (figure(1e3 * choice.expected[who][what]) for who in ("chosen", "random", "all"))
        shown.add_row(EXPECTED_OF[what], *cells)
    terminal.show(Text(""), shown)
    if choice.criterion == "A" and choice.limit:
        more = 100 * ((choice.design.value / choice.limit) ** 0.5 - 1)
        terminal.show(Text(f"no {count} of these poses are better by more than {figure(more, 2)} %", style="dim"))
    terminal.show(Text(f"from lengths with {figure(1e3 * choice.noise.length)} mm of noise", style="dim"))
