"""The verb `export`: a robot model in the form that the next program wants."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from robocal.arms.chain import Chain
from robocal.arms.conventions import convention_of, default_free, rows
from robocal.errors import FileError, ModelError, nearest
from robocal.files.robot import Robot, describe
from robocal.files.rows import leaves, same
from robocal.files.text import write_text
from robocal.files.units import UNITS, Units, number
from robocal.jobs.inputs import open_arm
from robocal.jobs.reference import nominal_chain, run_result
from robocal.jobs.urdf_text import urdf_text
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["FORMATS", "Exported", "export", "joint_offsets"]

FORMATS = ("yaml", "urdf", "csv", "markdown", "offsets")


@dataclass(frozen=True)
class Exported:
    """The text, the file that it was written to (None: to be shown), and what a person should know of it."""

    form: str
    text: str
    written: Path | None
    notes: tuple[str, ...] = ()


def export(
    robot: str,
    *,
    form: str = "yaml",
    output: Path | None = None,
    nominal: str | None = None,
    force: bool = False,
    base: str | None = None,
    tip: str | None = None,
) -> Exported:
    """The robot (a file, a catalogue name or a run folder) in another form. Raises InputError, also for a form that
    cannot hold it."""
    if form not in FORMATS:
        raise ModelError(
            "unknown format", key="--format", found=form, expected=", ".join(FORMATS), suggestion=nearest(form, FORMATS)
        )
    arm = open_arm(robot, base=base, tip=tip)
    notes: tuple[str, ...] = ()
    told = tuple(w for w in arm.warnings if "run folder" in w or "result.json" in w)
    if form == "yaml":
        text = arm.text if arm.format == "yaml" else describe(arm.chain, Units(UNITS["m"], UNITS["rad"]))
    elif form == "urdf":
        text, notes = (arm.text, ()) if arm.format == "urdf" else urdf_text(arm.chain)
        if arm.format == "urdf" and arm.left_out:
            notes = (f"a URDF cannot hold the fitted {', '.join(arm.left_out)}; --format yaml can",)
    elif form == "offsets":
        text = _offsets(robot, arm, nominal)
    else:
        table = parameter_table(arm)
        text = _csv(table) if form == "csv" else _markdown(table)
    notes = (*told, *notes)
    if output is None:
        return Exported(form, text, None, notes)
    if output.exists() and not force:
        raise FileError(
            "this file exists and is left as it is", file=output, expected="--force to replace it, or another name"
        )
    return Exported(form, text, write_text(output, text), notes)


# --- the parameter table --------------------------------------------------------------------------------------------


def parameter_table(robot: Robot) -> list[list[str]]:
    """Header and rows in the robot's units: one row per joint, then its base and tool; columns are the convention's
    keys."""
    chain, units = robot.chain, robot.units
    rule = convention_of(chain.convention)
    if any(key.quantity == "steps" for key in rule.keys):
        return _parameter_list(robot)
    header: dict[str, str] = {}
    body: list[tuple[str, str, dict[str, str]]] = []
    for i, row in enumerate(rows(chain), start=1):
        cells = {}
        for path, value, unit in leaves(row, rule, units):
            name = str(path[0]) + (
                ("xyz"[int(path[1])] if path[0] != "limits" else ("_lower", "_upper")[int(path[1])])
                if len(path) > 1
                else ""
            )
            header.setdefault(name, name if unit.si == "1" else f"{name} [{unit.name}]")
            cells[name] = number(unit.from_si(value))
        body.append((str(row.get("name", f"j{i}")), str(row.get("type", "revolute")), cells))
    for owner in ("base", "home", "tool"):
        if f"{owner}.x" in chain.table:
            cells = {}
            for s in FRAME_SYMBOLS:
                unit = units.of(chain.table[f"{owner}.{s}"].unit)
                header.setdefault(f"frame_{s}", f"frame_{s} [{unit.name}]")
                cells[f"frame_{s}"] = number(unit.from_si(chain.table[f"{owner}.{s}"].value))
            body.append((owner, "frame", cells))
    return [
        ["name", "type", *header.values()],
        *([name, kind, *(cells.get(h, "") for h in header)] for name, kind, cells in body),
    ]


def _parameter_list(robot: Robot) -> list[list[str]]:
    """Every parameter on a row of its own, where rows of joints have no common columns."""
    table = robot.chain.table
    return [
        ["parameter", "value", "unit"],
        *([p.name, number(robot.units.of(p.unit).from_si(p.value)), robot.units.of(p.unit).name] for p in table.rows),
    ]


def _csv(table: list[list[str]]) -> str:
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(table)
    return stream.getvalue()


def _markdown(table: list[list[str]]) -> str:
    lines = ["| " + " | ".join(row) + " |" for row in table]
    lines.insert(1, "|" + "---|" * len(table[0]))
    return "\n".join(lines) + "\n"


# --- joint offsets ----------------------------------------------------------------------------------------------------------


def joint_offsets(nominal: Chain, corrected: Mapping[str, float]) -> list[tuple[str, float]]:
    """What to add to every joint value (rad or m) before the nominal model, from corrected parameter values in SI.

    The joint's element has the value factor * gain * q + offset; the offset's change, seen as a change of q, is
    divided by factor and gain.
    """
    out = []
    for joint in nominal.joints:
        for element in nominal.elements:
            drive = next((t for t in element.terms if t.column == joint.name), None)
            own = next((t for t in element.terms if t.column == "1"), None)
            if drive is not None and own is not None:
                change = own.factor * (corrected[own.parameter] - nominal.table[own.parameter].value)
                out.append((joint.name, change / (drive.factor * nominal.table[drive.parameter].value)))
                break
    return out


def _offsets(name: str, robot: Robot, nominal: str | None) -> str:
    """A CSV of joint offsets with their sigma where a run knows it."""
    known = run_result(name)
    table = robot.chain.table
    reference = nominal_chain(name, robot, nominal)
    if reference.table.names != table.names:
        raise ModelError(
            "the nominal robot has other joints or parameters",
            key="--nominal",
            found=nominal,
            expected=", ".join(robot.chain.joint_names),
        )
    found = joint_offsets(reference, {p.name: p.value for p in table.rows})
    own = {n for joint in robot.chain.joint_names for n in _driven(robot.chain, joint)}
    shifted = any(not same(table[n].value, reference.table[n].value) for n in own)
    # Where a convention frees other parameters by itself (a URDF's rz, cpc's beta), zero errors of joints are in these.
    if not found or not (shifted or own & {*default_free(robot.chain)}):
        raise ModelError(
            "this convention keeps joint offsets inside its frames",
            found=robot.chain.convention,
            expected="--format yaml or urdf",
        )
    moved = [n for n in robot.chain.geometric if not same(table[n].value, reference.table[n].value)]
    if moved and not shifted:
        raise ModelError(
            "no joint offset differs from the nominal robot, but other parameters do: offsets alone would correct nothing",
            found=", ".join(moved),
            expected="--format yaml or urdf",
        )
    sigmas = {p.name: p.sigma for p in known.parameters} if known else {}
    lines = [["joint", "offset", "sigma", "unit"]]
    for joint, (owner, value) in zip(robot.chain.joints, found, strict=True):
        unit = robot.units.of("m" if joint.type == "prismatic" else "rad")
        sigma = next(
            (s for n, s in sigmas.items() if n.rpartition(".")[0] == owner and n in _driven(robot.chain, owner)), None
        )
        lines.append(
            [
                owner,
                number(value / unit.factor),
                "" if sigma is None else f"{sigma:.3g}",
                unit.name,
            ]
        )
    return "# Feed the nominal model with joint value + offset.\n" + _csv(lines)


def _driven(chain: Chain, joint: str) -> tuple[str, ...]:
    """The parameters that add to a joint's own value."""
    return tuple(
        t.parameter
        for e in chain.elements
        if any(s.column == joint for s in e.terms)
        for t in e.terms
        if t.column == "1"
    )
