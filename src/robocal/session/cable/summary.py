"""A cable robot summed up: what its file says, cable by cable, and what follows before anything is measured."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal.cables.geometry import CableRobot
from robocal.files.cable.cablefile import CableFile
from robocal.files.display import in_units
from robocal.quantities import Column, Listing, UnitValue, unit_value
from robocal.report.sections import Section, Text, figure, listing_table, quiet

__all__ = ["CableFacts", "facts", "summary"]


WORDS = {"a": "frame anchors", "b": "platform anchors", "com": "centre of mass", "zero": "zeros", "pulley": "pulleys"}


@record(kw_only=True)
class CableFacts:
    """What is known of a cable robot, and what follows: redundancy, extents of the frame and of the platform, what is not known; one row
    for each cable."""

    degrees: str
    plane: str | None
    redundancy: int
    frame: UnitValue
    platform: UnitValue
    mass: UnitValue | None
    com: UnitValue | None
    not_known: list[str]
    assumed: tuple[str, ...]
    cables: Listing


def facts(robot: CableRobot) -> CableFacts:
    """What is known, SI, and what follows."""
    known = ("mass", "limits", "elasticity", "density", "diameter")
    return CableFacts(
        degrees=robot.degrees, plane=robot.plane if robot.planar else None, redundancy=len(robot.cables) - len(robot.axes),
        frame=UnitValue(np.ptp(robot.frame_points, axis=0), "m"),
        platform=UnitValue(np.ptp(robot.platform_points, axis=0), "m"),
        mass=unit_value(robot.mass, "kg"), com=None if robot.mass is None else UnitValue(robot.com, "m"),
        not_known=[name for name in known if getattr(robot, name) is None], assumed=robot.assumed, cables=_cables(robot),
    )  # fmt: skip


def _cables(robot: CableRobot) -> Listing:
    ways, wheels = robot.segments, robot.wheels
    columns: list[tuple[str, str, Any]] = [
        *(
            [("frame anchor", "m", robot.a), ("platform anchor", "m", robot.b)]
            if ways.is_plain
            else [("runs along", "", [ways.sum_of(i) for i in range(len(robot.cables))])]
        ),
        ("zero", "m", robot.zeros),
        ("gain", "", robot.gain if robot.states_gains else None),
        ("build_up", "1/m", robot.build_up if robot.states_build_up else None),
        ("tension", "N", robot.limits),
        ("diameter", "m", robot.diameter),
        ("elasticity", "1/N", robot.elasticity),
        ("density", "N/m", robot.density),
    ]
    if wheels is not None and ways.is_plain:
        axes = [axis if radius > 0 else None for axis, radius in zip(wheels.axis.tolist(), wheels.radius, strict=True)]
        columns[6:6] = [("pulley", "m", wheels.radius), ("pulley axis", "", axes)]
    return Listing((Column("cable", "", robot.cables), *(Column(n, u, v) for n, u, v in columns if v is not None)))


def summary(file: CableFile) -> Iterator[Section]:
    """Every cable, and the platform in a few lines, in the units of the file."""
    robot, length = file.robot, file.units.length
    said = facts(robot)
    cables = in_units(said.cables.without("pulley axis"), file.units)
    spare, unit = said.redundancy, file.units.mass
    size = " x ".join(figure(float(v) / length.factor, 3) for v in said.frame.value)
    mass = "mass not known" if robot.mass is None else f"{figure(robot.mass / unit.factor)} {unit.name}"
    held = f"{abs(spare)} cables {'more' if spare > 0 else 'fewer'} than" if spare else "as many cables as"
    lines = [f"{robot.degrees}, {held} freedoms; frame {size} {length.name}; platform {mass}"]
    if said.not_known:
        lines.append(f"not known: {', '.join(said.not_known)}")
    if robot.assumed:
        # c1.b to c8.b are one thing.
        what = dict.fromkeys(name.rpartition(".")[2] for name in robot.assumed)
        lines.append(f"assumed, not known: {', '.join(WORDS.get(w, w) for w in what)}")
    yield Section.of("", Text.of(lines[0]), replace(listing_table(cables), right=()), *quiet(*lines[1:]))
