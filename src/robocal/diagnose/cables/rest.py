"""Tensions that were read, beside the platform that they hold: whether any platform at rest hangs so, how heavy it is, and which
column or row stands wrong.

    W_j t_j + m g_j + (R_j m c) x g = 0      in the freedoms of the platform, linear in m and m c

With the geometry as stated, a few centimetres off, a tension pulls a hundredth off its direction: only what is far beyond that counts.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robocal._record import record
from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.diagnose import limits
from robocal.diagnose.check_registry import Context, Finding, Given, Level, When, check, doubt, refuse
from robocal.fit.starts.own import place_configurations
from robocal.geometry import se3
from robocal.measure.data import Observations
from robocal.remarks.code import Code
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["CELLS", "EXCHANGED", "NOT_AT_REST", "SHIFTED", "Balance", "balance", "rest"]

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
    read = [o for o in data.observations if "tension" in o.extra and o.options.get("tension") is None]
    start = place_configurations(robot, data).configurations.starts if read else np.zeros((0, 6))
    for obs in read:
        at, tension = _complete(robot, obs)
        if len(at) < limits.TENSION_POSES or len(robot.cables) < len(robot.axes):
            continue
        finding = _judge(robot, obs, balance(robot, se3.from_vector(start[at]), tension))
        if finding is not None:
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


def _judge(robot: CableRobot, obs: Observations, found: Balance) -> Finding | None:
    load = obs.kind == "load"
    here = {"source": obs.source, "kind": "load" if load else "tension"}
    force = {"left": Quantity(found.left, "N"), "allowed": Quantity(found.allowed, "N")}
    if found.exchanged is not None:
        one, other = (robot.cables[i] for i in found.exchanged)
        return refuse(EXCHANGED, **here, one=one, other=other, **force)
    if found.shifted is not None:
        return refuse(SHIFTED, **here, rows=abs(found.shifted), where="low" if found.shifted > 0 else "high", **force)
    if found.left > found.allowed * (1.0 if load else limits.TENSION_FARTHER):
        return refuse(NOT_AT_REST, **here, **force)
    mass = robot.mass
    if mass is None or mass / limits.TENSION_MASS < found.mass < mass * limits.TENSION_MASS:
        return None
    weighed = {"mass": Quantity(found.mass, "kg"), "stated": Quantity(mass, "kg")}
    if not load:
        return doubt(Code.TENSIONS_WEIGH, **weighed)
    factor = mass / found.mass if found.mass > 0 else np.inf
    near = (unit for known, unit in KNOWN.items() if abs(factor / known - 1) < limits.CELL_UNIT_NEAR)
    return refuse(CELLS, **here, **weighed, unit=next(near, "another unit, or no tare"))


SHIFTS = (-3, -2, -1, 1, 2, 3)


@record
class Balance:
    """What tensions of a platform at rest weigh, kg, the force that they leave, rms N, and the force that directions which are a tenth off
    would; `exchanged` are two cables whose readings, changed over, leave far less, `shifted` the number of rows by which all are late."""

    mass: float
    left: float
    allowed: float
    exchanged: tuple[int, int] | None = None
    shifted: int | None = None


def balance(robot: CableRobot, poses: ArrayLike, tensions: ArrayLike) -> Balance:
    """Of poses (k, 4, 4) and tensions (k, m) in N."""
    t, pull = np.asarray(poses, float), np.asarray(tensions, float)
    w, unit = structure_of(robot, t), _by_body(robot, t)
    mass, left = _left(w, unit, pull)
    allowed = limits.TENSION_DIRECTIONS * float(np.sqrt(np.mean(np.sum(pull**2, axis=1))))
    exchanged = shifted = None
    if left > allowed:
        pairs = list(combinations(range(pull.shape[1]), 2))
        tried = {pair: _left(w, unit, _exchange_columns(pull, *pair))[1] for pair in pairs}
        late = {by: _left(w, unit, np.roll(pull, by, axis=0))[1] for by in SHIFTS if len(pull) > 2 * abs(by)}
        pair, row = min(tried, key=tried.__getitem__), min(late, key=late.__getitem__, default=None)
        if tried[pair] < limits.TENSION_CLEARLY * left:
            exchanged = pair
        elif row is not None and late[row] < limits.TENSION_CLEARLY * left:
            shifted = -row
    return Balance(mass, left, allowed, exchanged, shifted)


def _by_body(robot: CableRobot, poses: Array) -> Array:
    """Wrench (k, d, 4) by the mass and by mass times centre of mass."""
    rows = list(robot.axes)
    still = gravity_wrench(poses, 1.0, np.zeros(3))
    return np.stack([still, *(gravity_wrench(poses, 1.0, e) - still for e in np.eye(3))], axis=-1)[:, rows]


def _exchange_columns(pull: Array, i: int, j: int) -> Array:
    out = pull.copy()
    out[:, [i, j]] = pull[:, [j, i]]
    return out


def _left(w: Array, unit: Array, pull: Array) -> tuple[float, float]:
    """Mass and the rms of the force that is left, of the best mass and centre of mass."""
    wrench = np.einsum("kdm,km->kd", w, pull)
    body = np.linalg.lstsq(unit.reshape(-1, 4), -wrench.ravel(), rcond=1e-9)[0]
    left = wrench + unit @ body
    moves = left.shape[1] if left.shape[1] < 3 else 3 if left.shape[1] == 6 else 2
    return float(body[0]), float(np.sqrt(np.mean(np.sum(left[:, :moves] ** 2, axis=1))))
