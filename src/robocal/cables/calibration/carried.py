"""What a calibration leaves of poses that follow from lengths: dT = -L^+ (dl / dx) dx, to first order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.cables.gradient import by_parameters

__all__ = ["pose_covariance"]


def pose_covariance(
    robot: CableRobot,
    pose: ArrayLike,
    names: Sequence[str],
    covariance: ArrayLike,
    more: Mapping[str, Array] | None = None,
) -> Array:
    """Covariance (k, d, d) of the twist (v, w) of poses (k, 4, 4), in the components that the robot has, that a covariance (n, n) of
    its anchors, zeros and pulleys `names` leaves where lengths are exact. Not a number where a pose is none. `more` are the slopes
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
