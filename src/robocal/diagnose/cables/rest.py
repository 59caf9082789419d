"""Tensions that were read, beside the platform that they hold: whether any platform at rest hangs so, and how heavy it is."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.diagnose.cables.balance import Balance, balance
from robocal.diagnose.check_registry import Context, Finding, Given, Level, When, check, doubt, refuse
from robocal.diagnose.limits import CELL_UNIT_NEAR, TENSION_FARTHER, TENSION_MASS, TENSION_POSES
from robocal.fit.starts.own import place_configurations
from robocal.geometry import se3
from robocal.measure.data import Observations
from robocal.remarks.code import Code
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["CELLS", "EXCHANGED", "NOT_AT_REST", "SHIFTED", "rest"]

KNOWN = {9.80665: "kgf for N", 4.4482216152605: "lbf for N", 1000.0: "kN for N", 0.001: "mN for N"}
LEFT = ": they leave {left:.3g} of force, geometry would {allowed:.3g}"
EXCHANGED = declare(
    "tensions-exchanged",
    "the tensions of {one} and {other} are exchanged" + LEFT,
    "Name their columns in the order of {one}, {other}.",
)
SHIFTED = declare(
    "tensions-shifted", "the tensions stand {rows} rows too {where}" + LEFT, "Write each beside the id of its pose."
)
NOT_AT_REST = declare(
    "not-at-rest",
    "these tensions cannot hold a platform at rest",
    "Check the order of the columns, the unit, and whether the platform stood still.",
)
CELLS = declare(
    "cells-weigh",
    "the load cells measure another mass than that of the platform",
    "Check the unit of the cells, or the platform's mass in the robot's file.",
)


@check("rest", When.READ, order=40, given=Given.ACCEPTED, needs=("data",))
def rest(context: Context[CableRobot]) -> Iterator[Finding]:
    """The tensions of every instrument that read them, at the poses from which a fit starts."""
    robot, data = context.model, context.need_data
    start: Array | None = None
    for obs in data.observations:
        if "tension" not in obs.extra or obs.options.get("tension") is not None:
            continue
        if start is None:
            start = place_configurations(robot, data).configurations.start
        assert start is not None
        at, tension = _complete(robot, obs)
        if len(at) < TENSION_POSES or len(robot.cables) < len(robot.axes):
            continue
        for finding in _judge(robot, obs, balance(robot, se3.from_vector(start[at]), tension)):
            yield finding
            if finding.level is Level.REFUSE:
                return


def _complete(robot: CableRobot, obs: Observations) -> tuple[NDArray[np.int64], Array]:
    """Configurations (k,) and their tensions (k, m), of which none is missing."""
    at, where = np.unique(obs.configuration, return_inverse=True)
    if obs.extra["tension"].ndim == 2:
        _, first = np.unique(obs.configuration, return_index=True)
        return at, obs.extra["tension"][first]
    out = np.full((len(at), len(robot.cables)), np.nan)
    out[where.ravel(), obs.extra["cable"].astype(np.int64)] = obs.extra["tension"]
    whole = np.isfinite(out).all(axis=1)
    return at[whole], out[whole]


def _judge(robot: CableRobot, obs: Observations, found: Balance) -> Iterator[Finding]:
    load = obs.kind == "load"
    here = {"source": obs.source, "kind": "load" if load else "tension"}
    force = {"left": Quantity(found.left, "N"), "allowed": Quantity(found.allowed, "N")}
    if found.exchanged is not None:
        one, other = (robot.cables[i] for i in found.exchanged)
        yield refuse(EXCHANGED, **here, one=one, other=other, **force)
        return
    if found.shifted is not None:
        yield refuse(SHIFTED, **here, rows=abs(found.shifted), where="low" if found.shifted > 0 else "high", **force)
        return
    if found.left > found.allowed * (1.0 if load else TENSION_FARTHER):
        yield refuse(NOT_AT_REST, **here, **force)
        return
    mass = robot.mass
    if mass is None or mass / TENSION_MASS < found.mass < mass * TENSION_MASS:
        return
    if load:
        factor = mass / found.mass if found.mass > 0 else np.inf
        unit = next((w for f, w in KNOWN.items() if abs(factor / f - 1) < CELL_UNIT_NEAR), "another unit, or no tare")
        yield refuse(CELLS, **here, mass=Quantity(found.mass, "kg"), stated=Quantity(mass, "kg"), unit=unit)
    else:
        yield doubt(Code.TENSIONS_WEIGH, mass=Quantity(found.mass, "kg"), stated=Quantity(mass, "kg"))
