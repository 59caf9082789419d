"""Where a platform stood, from an instrument that stands nobody knows where and lengths that count from nobody knows where.

    |s_j - a| = y_j + l0      per cable, in the instrument's frame: its frame anchor a and its zero l0
    T a_i = a                 the nominal anchors i brought to those: the frame

Cable by cable the equations are solved without a guess (`cables.calibration.per_cable`), so no zero needs a start.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array
from robocal.cables.calibration.per_cable import per_cable
from robocal.cables.geometry import lengths
from robocal.errors import ModelError
from robocal.geometry import fits, se3
from robocal.measure.cable.platform_rows import cable_robot_of
from robocal.measure.data import Observations
from robocal.measure.lengths import WHAT, readings
from robocal.measure.machine import Model

__all__ = ["machine_size", "place_by_anchors", "zero_spread"]


def machine_size(machine: Model) -> float:
    """The mean distance of two frame anchors (m)."""
    robot = cable_robot_of(machine, WHAT)
    away = np.linalg.norm(robot.a[:, None] - robot.a[None], axis=-1)
    return float(away[np.triu_indices(len(robot.a), 1)].mean())


def zero_spread(machine: Model, obs: Observations, pose: Array) -> float:
    """How far the nominal lengths at poses (U, 4, 4) differ from what was read, beyond a constant of each cable: the root mean square
    (m) over the rows with a pose."""
    robot = cable_robot_of(machine, WHAT)
    y, square, count = readings(robot, obs, len(pose)), 0.0, 0
    for i in range(len(robot.cables)):
        some = np.flatnonzero(np.isfinite(y[:, i]) & np.isfinite(pose[:, 0, 0]))
        if len(some) > 1:
            full = lengths(pose[some][None], np.append(robot.numbers[i, :6], 0.0)[None], robot.pulley(i))[0][0]
            square, count = square + float(((full - y[some, i]).var()) * len(some)), count + len(some)
    return float(np.sqrt(square / count)) if count else np.inf


def place_by_anchors(machine: Model, obs: Observations, seen: Array) -> Array | None:
    """T_base_platform (U, 4, 4) from poses (U, 4, 4) in the frame of an instrument; None where they do not tell where anchors are."""
    robot = cable_robot_of(machine, WHAT)
    y = readings(robot, obs, len(seen))
    some = np.isfinite(seen[:, 0, 0]) & np.isfinite(y).any(axis=1)
    try:
        found = per_cable(robot, seen[some], y[some])
    except ModelError:
        return None
    good = np.isfinite(found.anchors[0]).all(axis=1)
    if good.sum() < 3:
        return None
    return np.asarray(se3.inverse(fits.rigid(robot.a[good], found.anchors[0][good])) @ seen)
