"""A cable robot's workspace on the terminal. Positions and forces are in the robot file's units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.text import Text

from robocal.cli.show import figure, show_paths, table
from robocal.cli.terminal import Terminal

if TYPE_CHECKING:
    from robocal.jobs.cable.workspace_result import Workspace

__all__ = ["show_workspace"]


def show_workspace(terminal: Terminal, made: Workspace) -> None:
    """How large it is by either way, where, and what is to spare there."""
    if terminal.json:
        return
    found, length, force = made.document, made.units.length, made.units.force
    what, unit = ("volume_m3", "m3") if "volume_m3" in found["grid"] else ("area_m2", "m2")

    def at(point: Sequence[float]) -> str:
        return ", ".join(f"{round(length.from_si(float(v)), 9) + 0.0:.4g}" for v in point)

    name = what.split("_")[0]
    grid, rays = found["grid"], found["rays"]
    head = f"   {_demanded(found['demand'])}"
    terminal.show(Text.assemble((made.robot.name, "bold"), head), Text(""))
    shown = table(name, unit, "", right=(1,))
    counts = " x ".join(str(n) for n in grid["cells"] if n > 1)
    shown.add_row("grid", figure(grid[what]), f"{counts} cells, {100 * grid['share_of_box']:.1f} % of the box")
    if rays is not None:
        start = f"{rays['count']} rays from {at(rays['start_m'])} {length.name} ({rays['start']})"
        if rays["difference"] is not None:
            start += f", {100 * rays['difference']:+.2f} %"
        shown.add_row("rays", figure(rays[what]), start)
    terminal.show(shown, Text(""))
    ends = "   ".join(f"{axis} {at([low])} to {at([high])}" for axis, (low, high) in zip("xyz", made.box, strict=True))
    terminal.say(f"box: {ends} {length.name}  ({made.how})")
    if found["extent_m"] is not None:
        ends = "   ".join(
            f"{a} {at([low])} to {at([high])}" for a, (low, high) in zip("xyz", found["extent_m"], strict=True)
        )
        cut = f"; cut off by the box at {', '.join(found['reaches_box'])}" if found["reaches_box"] else ""
        terminal.say(f"held: {ends} {length.name}, centre {at(found['centre_m'])}{cut}")
        _spares(terminal, made, found, force)
        best = found["best"]
        terminal.say(
            f"greatest margin: {figure(force.from_si(best['margin_N']))} {force.name} at {at(best['position_m'])} {length.name}"
        )
    home = found["home"]
    terminal.say(
        f"X_0, the mean of the frame anchors, {at(home['position_m'])} {length.name}: {'held' if home['held'] else 'not held'}"
    )
    show_paths(terminal, made.written)


def _spares(terminal: Terminal, made: Workspace, found: dict[str, Any], force: Any) -> None:
    """Margins and possible accelerations of the held cells."""
    for key, title, unit in (
        ("margin_N", "margin", force.name),
        ("acceleration_m_s2", "possible acceleration", "m/s2"),
    ):
        spread = [found[key][k] for k in ("least", "median", "greatest")]
        if key == "margin_N":
            spread = [force.from_si(v) for v in spread]
        if np.isfinite(spread).all():
            least, median, greatest = (figure(float(v), 3) for v in spread)
            terminal.say(f"{title}: {least} to {greatest} {unit}, median {median}")


def _demanded(demand: dict[str, Any]) -> str:
    masses = " and ".join(f"{m:.4g}" for m in demand["masses_kg"]) + " kg"
    turns = len(demand["orientations_rad"])
    words = [masses, "one orientation" if turns == 1 else f"{turns} orientations"]
    if len(demand["wrenches"]) > 1 or np.any(demand["wrenches"]):
        words.append(f"{len(demand['wrenches'])} wrench{'es' if len(demand['wrenches']) > 1 else ''}")
    if demand["acceleration_m_s2"] > 0:
        words.append(f"{demand['acceleration_m_s2']:.3g} m/s2")
    if demand["reserve_N"] > 0:
        words.append(f"{demand['reserve_N']:.3g} N in reserve")
    return ", ".join(words)
