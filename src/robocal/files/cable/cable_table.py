"""The table of a cable robot's parameters: one row per cable, in the units of its file."""

from __future__ import annotations

import numpy as np

from robocal.cables.geometry import STRETCH, SYMBOLS, UNITS, WHEEL, CableRobot
from robocal.files.cable.cable_model import CableUnits
from robocal.files.units import number

__all__ = ["cable_rows"]

# What people call the numbers of SYMBOLS.
TITLES = ("frame_x", "frame_y", "frame_z", "platform_x", "platform_y", "platform_z", "zero")
WHEELS = ("pulley_radius", "axis_x", "axis_y", "axis_z")


def cable_rows(robot: CableRobot, units: CableUnits) -> list[list[str]]:
    """Header and rows: the cable, its anchors, its zero, and of its pulley and its stretch what is known; every number with 15 digits."""
    columns: list[tuple[str, str, list[float]]] = [
        (title, "m", robot.numbers[:, i].tolist()) for i, title in enumerate(TITLES[: len(SYMBOLS)])
    ]
    if robot.pulleys is not None:
        wheel = np.column_stack([robot.pulleys.radius, robot.pulleys.axis])
        columns += [
            (title, UNITS.get(symbol, "1"), wheel[:, i].tolist())
            for i, (title, symbol) in enumerate(zip(WHEELS, WHEEL, strict=True))
        ]
    if robot.elasticity is not None:
        columns.append((STRETCH, UNITS[STRETCH], robot.elasticity.tolist()))
    known = [(title, units.of(si), values) for title, si, values in columns]
    header = ["cable", *(title if unit.si == "1" else f"{title} [{unit.name}]" for title, unit, _ in known)]
    rows = (
        [cable, *(number(unit.from_si(values[i])) for _, unit, values in known)] for i, cable in enumerate(robot.cables)
    )
    return [header, *rows]
