"""How the lengths of a robot's cables follow its pose and its parameters, and what a calibration leaves of poses that follow from
lengths: dT = -L^+ (dl / dx) dx, to first order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array
from robocal.cables.geometry import BUILD_UP, GAIN, SYMBOLS, WHEEL, CableRobot, lengths, straight
from robocal.cables.pulley import Pulleys, by_wheel
from robocal.cables.rail import RAIL, by_rail

__all__ = ["by_parameters", "pose_covariance"]


def by_parameters(robot: CableRobot, poses: ArrayLike, names: Sequence[str]) -> tuple[Array, Array]:
    """Gradients of the lengths without stretch less what their drums wound up, at poses (k, 4, 4): L (k, m, 6) by the twist (v, w), and
    (k, m, n) by the parameters `names`, of anchors, zeros, pulleys and drums."""
    t = np.asarray(poses, float)
    at = {n: i for i, n in enumerate(names)}
    by_pose, out = np.empty((len(t), len(robot.cables), 6)), np.zeros((len(t), len(robot.cables), len(names)))
    ways, many = robot.segments, len(robot.cables)
    full, by_pose[:], _ = straight(robot, t)
    read = robot.readings(full - robot.zeros)
    for i, cable in enumerate(robot.cables):
        for symbol, column in ((GAIN, read[:, i]), (BUILD_UP, read[:, i] ** 2)):
            if (where := at.get(robot.row(f"{cable}.{symbol}"))) is not None:
                out[:, i, where] -= column
    for s, (segment, i, times) in enumerate(zip(ways.names, ways.cable, ways.times, strict=True)):
        wheel = None if robot.wheels is None else Pulleys(robot.wheels.radius[s], robot.wheels.axis[s])
        pose = np.broadcast_to(np.eye(4), t.shape) if ways.still[s] else t
        own = lengths(pose[None], robot.ends[s][None], wheel)[2][0]
        columns = list(zip(SYMBOLS, (own * np.repeat([times, float(s < many)], [6, 1])).T, strict=True))
        if wheel is not None and wheel.radius != 0.0:
            a, b = robot.ends[s, :3], robot.ends[s, 3:6]
            by = times * by_wheel(pose[:, :3, 3] + pose[:, :3, :3] @ b - a, wheel)
            size = np.linalg.norm(robot.values_of(WHEEL[1:], (segment,)))
            columns += zip(WHEEL, (by / [1.0, size, size, size]).T, strict=True)
        if robot.rails is not None and robot.rails[s, 2:].any():
            columns += zip(RAIL, times * by_rail(robot.rails[s], own[:, :3]).T, strict=True)
        for symbol, column in columns:
            if (where := at.get(robot.row(f"{segment}.{symbol}"))) is not None:
                out[:, i, where] += column
    return by_pose, out


def pose_covariance(
    robot: CableRobot,
    pose: ArrayLike,
    names: Sequence[str],
    covariance: ArrayLike,
    more: Mapping[str, Array] | None = None,
) -> Array:
    """Covariance (k, d, d) of the twist (v, w) of poses (k, 4, 4), in the components that the robot has, that a covariance (n, n) of
    its anchors, zeros, pulleys and drums `names` leaves where lengths are exact. Not a number where a pose is none. `more` are the slopes
    (k, m) of the lengths by other names."""
    t = np.asarray(pose, float)
    by_pose, by_number = by_parameters(robot, t, names)
    for i, name in enumerate(names):
        if more and name in more:
            by_number[..., i] += more[name]
    good = np.isfinite(by_pose).all(axis=(1, 2))
    out = np.full((len(t), len(robot.axes), len(robot.axes)), np.nan)
    through = np.linalg.pinv(by_pose[good][..., list(robot.axes)]) @ by_number[good]
    out[good] = through @ np.asarray(covariance, float) @ through.swapaxes(1, 2)
    return out
