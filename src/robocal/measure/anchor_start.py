"""Where a platform stood, from an instrument that stands nobody knows where and lengths that count from nobody knows where.

    |s_j - a| = y_j + l0      per cable, in the instrument's frame: its frame anchor a and its zero l0
    T a_i = a                 the nominal anchors i brought to those: the frame

Cable by cable the equations are solved without a guess (`cables.calibration.per_cable`), so no zero needs a start.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array
from robocal.cables.calibration.per_cable import per_cable
from robocal.cables.geometry import CableRobot, straight
from robocal.errors import ModelError
from robocal.geometry import fits, se3, so3
from robocal.measure.cable.platform_rows import cable_robot_of
from robocal.measure.data import Observations
from robocal.measure.lengths import WHAT, readings
from robocal.measure.machine import Model

__all__ = ["machine_size", "place_by_anchors", "without_turns", "zero_spread"]


def machine_size(machine: Model) -> float:
    """The mean distance of two frame anchors (m)."""
    robot = cable_robot_of(machine, WHAT)
    a = np.unique(robot.frame_points, axis=0) if not robot.segments.is_plain else robot.a
    away = np.linalg.norm(a[:, None] - a[None], axis=-1)
    return float(away[np.triu_indices(len(a), 1)].mean())


def zero_spread(machine: Model, obs: Observations, pose: Array) -> float:
    """How far the nominal lengths at poses (U, 4, 4) differ from what was read, beyond a constant of each cable: the root mean square
    (m) over the rows with a pose."""
    robot = cable_robot_of(machine, WHAT)
    y, square, count = readings(robot, obs, len(pose)), 0.0, 0
    for i in range(len(robot.cables)):
        some = np.flatnonzero(np.isfinite(y[:, i]) & np.isfinite(pose[:, 0, 0]))
        if len(some) > 1:
            full = straight(robot, pose[some])[0][:, i]
            square, count = square + float(((full - y[some, i]).var()) * len(some)), count + len(some)
    return float(np.sqrt(square / count)) if count else np.inf


def place_by_anchors(machine: Model, obs: Observations, seen: Array, point: Array | None = None) -> Array | None:
    """T_base_platform (U, 4, 4) from poses (U, 4, 4) in the frame of an instrument; None where they do not tell where anchors are.

    Of an instrument that reads positions alone, `seen` is where the `point` (3,) of the platform was. The platform is then taken as if it
    did not turn: a - b + point is an anchor of that point.
    """
    robot = cable_robot_of(machine, WHAT)
    if not robot.segments.is_plain or "carriage" in obs.extra:
        return None  # of a sum of lengths no anchor follows by itself, and one on a rail is at no place
    anchors, y = robot.a, readings(robot, obs, len(seen))
    some = np.isfinite(seen[:, 0, 0]) & np.isfinite(y).any(axis=1)
    if point is not None:
        anchors = robot.a - robot.b + point
        robot = robot.with_values({f"{c}.b{s}": 0.0 for c in robot.cables for s in "xyz"})
    if not some.any():
        return None
    seen = _lay_in_plane(robot, seen[some]) @ seen
    try:
        found = per_cable(robot, seen[some], y[some])
    except ModelError:
        return None
    good = np.isfinite(found.anchors[0]).all(axis=1)
    if good.sum() < 3:
        return None
    placed = np.asarray(se3.inverse(fits.rigid(anchors[good], found.anchors[0][good])) @ seen)
    return placed if point is None else without_turns(placed, point)


def without_turns(placed: Array, point: Array) -> Array:
    """Poses (U, 4, 4) of a platform that does not turn, whose `point` (3,) is at the origins of these frames."""
    out = np.where(np.isfinite(placed), np.eye(4), np.nan)
    out[:, :3, 3] = placed[:, :3, 3] - point
    return out


def _lay_in_plane(robot: CableRobot, seen: Array) -> Array:
    """The motion (4, 4) that brings what an instrument saw of a planar robot into the plane of its anchors, either side up; none of a
    robot in space."""
    across = [i for i in range(3) if i not in robot.axes]
    if len(across) != 1 or len(seen) < 3:
        return np.eye(4)
    k = across[0]
    normal = fits.plane(seen[:, :3, 3])[0]
    normal = normal if normal[k] >= 0 else -normal
    axis = np.cross(normal, np.eye(3)[k])
    size = float(np.linalg.norm(axis))
    turn = so3.exp(axis * (np.arctan2(size, normal[k]) / size)) if size > 0 else np.eye(3)
    shift = np.zeros(3)
    shift[k] = float(robot.a[:, k].mean() - (seen[:, :3, 3] @ turn[k]).mean())
    return se3.compose(turn, shift)
