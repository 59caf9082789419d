"""How the lengths of a robot's cables follow its pose and its parameters, and what a calibration leaves of poses that follow from
lengths: dT = -L^+ (dl / dx) dx, to first order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array
from robocal.cables.geometry import GAIN, SYMBOLS, WHEEL, CableRobot, lengths
from robocal.cables.pulley import by_wheel

__all__ = ["by_parameters", "pose_covariance"]


def by_parameters(robot: CableRobot, poses: ArrayLike, names: Sequence[str]) -> tuple[Array, Array]:
    """Gradients of the lengths without stretch less what their drums wound up, at poses (k, 4, 4): L (k, m, 6) by the twist (v, w), and
    (k, m, n) by the parameters `names`, of anchors, zeros, pulleys and drums."""
    t = np.asarray(poses, float)
    at = {n: i for i, n in enumerate(names)}
    by_pose, out = np.empty((len(t), len(robot.cables), 6)), np.zeros((len(t), len(robot.cables), len(names)))
    for i, cable in enumerate(robot.cables):
        full, one, own = lengths(t[None], robot.numbers[i][None], robot.pulley(i))
        by_pose[:, i] = one[0]
        columns = [*zip(SYMBOLS, own[0].T, strict=True), (GAIN, -full[0] / robot.gain[i])]
        wheel = robot.pulley(i)
        if wheel is not None and wheel.radius != 0.0:
            a, b = robot.numbers[i, :3], robot.numbers[i, 3:6]
            columns += zip(WHEEL, by_wheel(t[:, :3, 3] + t[:, :3, :3] @ b - a, wheel).T, strict=True)
        for symbol, column in columns:
            if (where := at.get(robot.row(f"{cable}.{symbol}"))) is not None:
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
