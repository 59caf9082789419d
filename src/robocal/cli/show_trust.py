"""What can be trusted, on the terminal: predictions with their bands, and whether a robot has drifted."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from robocal.cli.show import figure, indented, show_paths, show_warnings, table
from robocal.cli.terminal import Terminal

if TYPE_CHECKING:
    from robocal.jobs.drift import Comparison
    from robocal.jobs.predict import Prediction

__all__ = ["show_drift", "show_prediction"]

MOST = 40
TEN = 10
COLOURS = {"unchanged": "bold green", "possible": "bold yellow", "drifted": "bold red"}
BLIND = 30.0  # deg: from here on nothing was known of a turn


def show_prediction(terminal: Terminal, found: Prediction) -> None:
    """One line per pose: where, and how far that may be off."""
    if terminal.json:
        for warning in found.warnings:
            terminal.warn(warning)
        return
    terminal.show(
        Text.assemble((found.robot.name, "bold"), f"   {len(found.rows)} poses of the tool, in base coordinates")
    )
    made = table(
        "configuration", "x [mm]", "y [mm]", "z [mm]", "rx [deg]", "ry [deg]", "rz [deg]", "± model", "± new", "± turn",
        right=tuple(range(1, 10)),
    )  # fmt: skip
    for row in found.rows[:MOST]:
        places = [f"{row[f'{a}_mm']:.3f}" for a in "xyz"] + [f"{row[f'r{a}_deg']:.3f}" for a in "xyz"]
        bars = [figure(row[k], 2) for k in ("band_mm", "band_new_mm", "turn_band_deg")]
        if row["turn_band_deg"] > BLIND:
            bars[2] = "not seen"
        made.add_row(row["configuration"], *places, *bars)
    terminal.show(Text(""), made)
    if len(found.rows) > MOST:
        terminal.show(Text(f"... and {len(found.rows) - MOST} more; -o FILE writes all", style="dim"))
    words = (
        "where the base stands included"
        if found.absolute
        else f"of the arm's shape: the base placed best over the {found.region}"
    )
    terminal.show(
        Text(
            f"± are 95 % radii: of the model [mm], of a new measurement [mm], of the model's turn [deg]; {words}",
            style="dim",
        ),
        Text(""),
    )
    show_warnings(terminal, found.warnings)
    if found.written:
        terminal.say(f"Written: {found.written[0]}")


def show_drift(terminal: Terminal, found: Comparison) -> None:
    """The verdict, how far predictions are apart, and the parameters that changed most."""
    if terminal.json:
        for warning in found.warnings:
            terminal.warn(str(warning))
        return
    document = found.document
    status, change = document["verdict"]["status"], document["change"]
    terminal.show(Text.assemble((found.robot.name, "bold"), f"   {found.runs[0]} and {found.runs[1]}"))
    size = (
        f"change {figure(change['change'], 2)} mm, 95 %: {figure(change['low'], 2)} to {figure(change['high'], 2)} mm"
    )
    word = Text(status.upper(), style=COLOURS[status])
    terminal.show(word if found.void else Text.assemble(word, "   ", (size, "bold")))
    terminal.show(*indented(*document["verdict"]["reasons"]), Text(""))
    made = table(
        "parameter", "first", "second", "change", "± 95 %", "unit", "chance", "of all", right=(1, 2, 3, 4, 6, 7)
    )
    changes = sorted(document["changes"], key=lambda c: c["p_value"])
    for c in changes[:TEN]:
        digits = 6
        bar = figure(1.96 * c["sigma"], 2)
        made.add_row(
            c["name"], figure(c["first"], digits), figure(c["second"], digits), f"{c['change']:+.4g}", bar, c["unit"],
            f"{c['p_value']:.1g}", f"{c['p_of_all']:.1g}", style="" if c["p_of_all"] < 0.05 else "dim",
        )  # fmt: skip
    terminal.show(made)
    if len(changes) > TEN:
        terminal.show(Text(f"... and {len(changes) - TEN} more in --json", style="dim"))
    terminal.show(
        Text("chance: of such a change by noise alone; of all: after looking at every parameter", style="dim"), Text("")
    )
    show_warnings(terminal, [str(w) for w in found.warnings])
    show_paths(terminal, found.written)
