"""The other verbs on the terminal: check, and the list of what `new` can start from."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rich.text import Text

from robocal.cli.show import figure, indented, show_warnings, strange, table
from robocal.cli.terminal import Terminal

if TYPE_CHECKING:
    from robocal.jobs.check import Checked
    from robocal.jobs.new import Listing

__all__ = ["show_check", "show_listing"]


def show_check(terminal: Terminal, found: Checked) -> None:
    """What files contain and what they can tell."""
    from robocal.jobs.strange import outlier

    if terminal.json:
        for warning in found.warnings:
            terminal.warn(warning)
        return
    machine = found.robot.machine
    parts = [f"{j.name}{'' if j.type == 'revolute' else ' (prismatic)'}" for j in machine.joints]
    noun, cables = "joints", found.document["robot"].get("cables")
    if cables:
        noun, parts = "cables", cables
    words = f"   convention {found.robot.convention}; {len(parts)} {noun}: {', '.join(parts)}"
    terminal.show(Text.assemble((machine.name, "bold"), words))
    if found.instruments:
        made = table("instrument", "kind", "rows", "configurations", "sigma", "frame", "targets", "file", right=(2, 3))
        for i in found.instruments:
            stated = ((i["sigma_m"], 1e3, "mm"), (i["sigma_rad"], 180 / math.pi, "deg"), (i["sigma_px"], 1.0, "px"))
            sigma = ", ".join(f"{figure(v * k, 2)} {unit}" for v, k, unit in stated if v is not None)
            sigma = sigma or i["sigma_source"]
            targets = ", ".join(i["targets"]) or "the tool"
            made.add_row(
                i["name"], i["kind"], str(i["rows"]), str(i["configurations"]), sigma, i["frame"], targets, i["source"]
            )
        terminal.show(Text(""), made)
    terminal.show(Text(""))
    if found.seen is None:
        names = ", ".join(found.free[:30]) + (", ..." if len(found.free) > 30 else "")
        terminal.show(
            Text(
                f"{len(found.free)} parameters of the robot are free: {names}"
                if found.free
                else "No parameter of the robot is free."
            )
        )
    else:
        seen = found.seen
        words = f"{seen.rank} of {len(seen.names)} free parameters can be seen"
        if found.assumed:
            words += " (where no sigma is stated, 0.1 mm and 0.1 mrad were assumed)"
        terminal.show(Text(words, style="bold"))
        kept = [n for n in seen.kept if n in machine.table]
        terminal.show(*indented(f"to be fitted: {', '.join(kept)}"))
        terminal.show(*indented(*(c.remark.sentence for c in seen.combinations)))
        if found.misfit is not None:
            terminal.show(
                Text(
                    f"Nominal model with frames and tool fitted: mean error {figure(found.misfit * 1e3)} mm{_without(found)}"
                )
            )
    terminal.show(Text(""), *strange([outlier(o) for o in found.strange]))
    show_warnings(terminal, found.warnings)


def _without(found: Checked) -> str:
    """Which rows a mean does not count."""
    aside = sum(o.set_aside for o in found.strange)
    if not aside or found.misfit_of_all is None:
        return ""
    return f", {figure(found.misfit_of_all * 1e3)} mm with the rows that are set aside ({aside})"


def show_listing(terminal: Terminal, found: Listing) -> None:
    """The catalogue and the conventions."""
    if terminal.json:
        return
    robots = table(
        "robot", "", "joints", "convention", right=(2,), title="Catalogue: these names are accepted wherever a robot is"
    )
    for name, title, convention, joints, _ in found.robots:
        robots.add_row(name, title, str(joints), convention)
    rules = table("convention", "each joint is", "complete", title="Conventions: for a robot of your own")
    for name, formula, complete, _ in found.conventions:
        rules.add_row(name, formula, "yes" if complete else "no")
    terminal.show(robots, Text(""), rules)
    terminal.show(Text("complete: every small geometric error can be written, parallel axes included", style="dim"))
    terminal.show(Text("cable: a robot on cables", style="dim"))
