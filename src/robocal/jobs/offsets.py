"""Joint offsets of a calibrated robot, for controllers that have nothing but zero errors: a table, parameters for ROS,
properties for xacro."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

from robocal.arms.chain import Chain
from robocal.arms.conventions import default_free
from robocal.errors import ModelError
from robocal.files.csvtable import csv_text
from robocal.files.robot import Robot
from robocal.files.rows import quoted, same
from robocal.files.units import Unit, number
from robocal.jobs.reference import nominal_chain, run_result

__all__ = ["OFFSETS", "Offset", "joint_offsets", "offset_text"]


@dataclass(frozen=True)
class Offset:
    """What to add to a joint's value before the nominal model, and its standard deviation, in SI; `unit` is the robot
    file's."""

    joint: str
    value: float
    sigma: float | None
    unit: Unit


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


def offset_text(name: str, robot: Robot, nominal: str | None, form: str) -> str:
    """The offsets of a robot's joints from its nominal model, with their sigma where a run knows it, in a form of
    `OFFSETS`.

    Raises ModelError where offsets alone would say nothing.
    """
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
    lines = []
    for joint, (owner, value) in zip(robot.chain.joints, found, strict=True):
        unit = robot.units.of("m" if joint.type == "prismatic" else "rad")
        sigma = next(
            (s for n, s in sigmas.items() if n.rpartition(".")[0] == owner and n in _driven(robot.chain, owner)), None
        )
        lines.append(Offset(owner, value, None if sigma is None else sigma * unit.factor, unit))
    return OFFSETS[form](lines, robot.name)


def _driven(chain: Chain, joint: str) -> tuple[str, ...]:
    """The parameters that add to a joint's own value."""
    return tuple(
        t.parameter
        for e in chain.elements
        if any(s.column == joint for s in e.terms)
        for t in e.terms
        if t.column == "1"
    )


def _table(offsets: Sequence[Offset], robot: str) -> str:
    """A CSV in the robot file's units."""
    rows = []
    for o in offsets:
        sigma = "" if o.sigma is None else f"{o.sigma / o.unit.factor:.3g}"
        rows.append([o.joint, number(o.value / o.unit.factor), sigma, o.unit.name])
    return "# Feed the nominal model with joint value + offset.\n" + csv_text(
        ["joint", "offset", "sigma", "unit"], rows
    )


def _ros(offsets: Sequence[Offset], robot: str) -> str:
    """A parameter file of ROS 2, for whichever node reads the joints; rad and m, as REP 103 has it."""
    lines = [
        f"# Joint offsets of {robot}, in rad and m: feed the nominal model with joint value + offset.",
        "/**:",
        "  ros__parameters:",
        "    joint_offsets:",
    ]
    return "\n".join([*lines, *(f"      {quoted(o.joint)}: {_real(o.value)}" for o in offsets)]) + "\n"


def _xacro(offsets: Sequence[Offset], robot: str) -> str:
    """Properties to be included by a xacro, which adds them to the joints' zero positions; rad and m."""
    lines = [
        '<?xml version="1.0"?>',
        f"<!-- Joint offsets of {robot.replace('--', '- -')}, in rad and m: model position = joint value + offset. -->",
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro">',
        *(
            f"  <xacro:property name={quoteattr(f'{o.joint}_offset')} value={quoteattr(_real(o.value))}/>"
            for o in offsets
        ),
        "</robot>",
    ]
    return "\n".join(lines) + "\n"


def _real(value: float) -> str:
    """A number that no parser takes for a whole one."""
    text = number(value)
    return text if any(c in text for c in ".e") else f"{text}.0"


OFFSETS: dict[str, Callable[[Sequence[Offset], str], str]] = {"offsets": _table, "ros": _ros, "xacro": _xacro}
