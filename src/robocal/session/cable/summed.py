"""A cable robot summed up: what its file says, cable by cable, and what follows before anything is measured."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from robocal.cables.geometry import CableRobot
from robocal.files.cable.cablefile import CableFile
from robocal.report.sections import Cell, Section, Text, figure, quiet, table

__all__ = ["facts", "summary"]


WORDS = {"a": "frame anchors", "b": "platform anchors", "com": "centre of mass", "zero": "zeros", "pulley": "pulleys"}


def facts(robot: CableRobot) -> dict[str, Any]:
    """What is known, SI, and what follows: redundancy, extents of the frame and of the platform, what is not known."""
    known = ("mass", "limits", "pulleys", "elasticity", "density", "diameter")
    return {
        "degrees": robot.degrees,
        "plane": robot.plane if robot.planar else None,
        "redundancy": len(robot.cables) - len(robot.axes),
        "frame_m": np.ptp(robot.a, axis=0),
        "platform_m": np.ptp(robot.b, axis=0),
        "mass_kg": robot.mass,
        "com_m": None if robot.mass is None else robot.com,
        "not_known": [name for name in known if getattr(robot, name) is None and name != "pulleys"],
        "assumed": list(robot.assumed),
        "cables": {c: _cable(robot, i) for i, c in enumerate(robot.cables)},
    }


def _cable(robot: CableRobot, i: int) -> dict[str, Any]:
    out: dict[str, Any] = {"frame_anchor_m": robot.a[i], "platform_anchor_m": robot.b[i], "zero_m": robot.zeros[i]}
    for name, unit in (("limits", "N"), ("elasticity", "1_N"), ("density", "N_m"), ("diameter", "m")):
        value = getattr(robot, name)
        if value is not None:
            out[f"{name}_{unit}"] = value[i]
    if robot.pulleys is not None and robot.pulleys.radius[i] > 0:
        out |= {"pulley_radius_m": robot.pulleys.radius[i], "pulley_axis": robot.pulleys.axis[i]}
    return out


def summary(file: CableFile) -> Iterator[Section]:
    """Every cable, and the platform in a few lines, in the units of the file."""
    robot, length = file.robot, file.units.length
    said = facts(robot)

    def shown(values: Any, factor: float = 1.0) -> str:
        return ", ".join(figure(float(v) / factor) for v in np.atleast_1d(values))

    more = [
        (f"tension [{file.units.force.name}]", None if robot.limits is None else robot.limits, file.units.force.factor),
        (f"diameter [{length.name}]", robot.diameter, length.factor),
        (f"pulley [{length.name}]", None if robot.pulleys is None else robot.pulleys.radius, length.factor),
        *(
            (f"{what} [{unit.name}]", values, unit.factor)
            for what, values, unit in (
                ("elasticity", robot.elasticity, file.units.of("1/N")),
                ("density", robot.density, file.units.of("N/m")),
            )
        ),
    ]
    told = [(name, values, factor) for name, values, factor in more if values is not None]
    rows: list[tuple[Cell, ...]] = [
        (
            c,
            *(shown(v, length.factor) for v in (robot.a[i], robot.b[i], robot.zeros[i])),
            *(shown(v[i], f) for _, v, f in told),
        )
        for i, c in enumerate(robot.cables)
    ]
    own = ("frame anchor", "platform anchor", "zero")
    columns = ("cable", *(f"{name} [{length.name}]" for name in own), *(n for n, *_ in told))
    spare = said["redundancy"]
    size = " x ".join(figure(float(v) / length.factor, 3) for v in said["frame_m"])
    mass = (
        "mass not known"
        if robot.mass is None
        else f"{figure(robot.mass / file.units.mass.factor)} {file.units.mass.name}"
    )
    held = (
        "as many cables as freedoms"
        if spare == 0
        else f"{abs(spare)} cables {'more' if spare > 0 else 'fewer'} than freedoms"
    )
    lines = [f"{robot.degrees}, {held}; frame {size} {length.name}; platform {mass}"]
    if said["not_known"]:
        lines.append(f"not known: {', '.join(said['not_known'])}")
    if robot.assumed:
        # c1.b to c8.b are one thing.
        what = dict.fromkeys(name.rpartition(".")[2] for name in robot.assumed)
        lines.append(f"assumed, not known: {', '.join(WORDS.get(w, w) for w in what)}")
    yield Section.of(
        "", *(Text.of(line) for line in lines[:1]), table(*columns, right=(), rows=rows), *quiet(*lines[1:])
    )
