"""A validation on the terminal: errors of a model, and the figures of ISO 9283."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rich.text import Text

from robocal.cli.show import figure, indented, show_paths, show_warnings, table
from robocal.cli.terminal import Terminal

if TYPE_CHECKING:
    from robocal.jobs.validate import Validation

__all__ = ["show_standard", "show_validation"]


def show_validation(terminal: Terminal, found: Validation) -> None:
    """The errors of a model, and of another one."""
    if terminal.json:
        for warning in found.warnings:
            terminal.warn(warning)
        return
    terminal.show(Text.assemble((found.robot.name, "bold"), f"   {len(found.poses)} measured positions"))
    if found.offsets is not None:
        terminal.show(Text(f"judged: the nominal robot with the joint offsets of {found.offsets}", style="dim"))
    for reason in found.reasons:
        terminal.show(Text.assemble(("NOT TO BE TRUSTED", "bold red"), f"  {reason.sentence}"))
        terminal.show(*(indented(reason.advice, style="dim") if reason.advice else ()))
    for unit, mine, theirs in (
        ("mm", found.statistic, found.statistic_against),
        ("deg", found.angle, found.angle_against),
    ):
        if mine is None:
            continue
        made = table(f"error [{unit}]", "mean", "rms", "95 %", "max", "n", "", right=(1, 2, 3, 4, 5))
        for label, s in (("this robot", mine), ("against", theirs)):
            if s is not None:
                note = Text("profiled" if s.profiled else "", style="dim")
                made.add_row(label, figure(s.mean), figure(s.rms), figure(s.p95), figure(s.max), str(s.n), note)
        if found.constant is not None and unit == "mm":
            made.add_row("predicting the mean", figure(found.constant), "", "", "", "", "", style="dim")
        terminal.show(Text(""), made)
    if found.frames:
        terminal.show(
            Text(f"profiled: {len(found.frames)} parameters of frames were fitted to these data", style="dim")
        )
    tool = [n for n in found.frames_against if n.startswith("tool.")]
    if tool:
        terminal.show(Text(f"of the robot compared with, {', '.join(tool)} were fitted to these data too", style="dim"))
    if found.gain is not None:
        mean, low, high = found.gain
        terminal.show(
            Text(f"mean error smaller by {figure(mean)} mm, 95 % interval {figure(low)} to {figure(high)} mm")
        )
    show_standard(terminal, found.iso)
    worst = sorted(found.poses, key=lambda p: -p["error_mm"])[:3]
    if len(found.poses) > 3:
        terminal.show(
            Text(
                "worst: " + ", ".join(f"{p['configuration']} {figure(p['error_mm'], 3)} mm" for p in worst), style="dim"
            )
        )
    terminal.show(Text(""))
    show_warnings(terminal, found.warnings)
    show_paths(terminal, found.written)


def show_standard(terminal: Terminal, iso: Mapping[str, Any]) -> None:
    """AP, RP, vAP, AD, RD: mean and largest over the places or pairs; what cannot be computed, and why."""
    if not iso:
        return
    compared = any("against" in (iso.get(part) or {}).get("summary", {}) for part in ("pose", "distance"))
    columns = ("ISO 9283", "mean", "max", *(("against: mean", "max") if compared else ()), "n", "")
    made = table(*columns, right=tuple(range(1, len(columns) - 1)))
    words = {"AP": "pose accuracy", "RP": "pose repeatability", "vAP": "multi-directional variation",
             "AD": "distance accuracy", "RD": "distance repeatability"}  # fmt: skip
    for part in ("pose", "distance"):
        found = iso.get(part)
        if not found:
            continue
        for name, s in found["summary"]["this"].items():
            other = found["summary"].get("against", {}).get(name, {})
            unit = found.get("angle_unit", "") if "_" in name else found["unit"]
            # Of repeatability there is only one: no model enters.
            there = (figure(other.get("mean")), figure(other.get("max"))) if name.startswith("A") else ("", "")
            note = words.get(name, "") + (f", {found['pairs']}" if name == "AD" else "")
            cells = (figure(s["mean"]), figure(s["max"]), *(there if compared else ()), str(s["n"]))
            made.add_row(f"{name} [{unit}]", *cells, Text(note, style="dim"))
    terminal.show(Text(""), made)
    for name, why in iso.get("not_computable", {}).items():
        terminal.show(Text(f"{name}: not computable: {why}", style="dim"))
    for note in iso.get("notes", ()):
        terminal.show(Text(note, style="dim"))
