"""What the numbers of a calibration may be off by, carried to lengths and poses: to first order, of where the platform is in base
coordinates, or of the robot's shape alone, wherever its base stands."""

from __future__ import annotations

import numpy as np

from robocal._types import Array
from robocal.cables.gradient import by_parameters
from robocal.estimate.uncertainty import Total
from robocal.prove.place_bands import motion_field
from robocal.session.cable.calibrated import Calibrated

__all__ = ["carried_covariance", "moved_by_numbers", "place_best", "slopes_of", "variance_of"]


def slopes_of(run: Calibrated, total: Total, pose: Array, shown: Array) -> tuple[Array, Array]:
    """Slopes of the lengths at poses (k, 4, 4), where sensors show (k, m), by the twist in the robot's components (k, m, d), and by all
    numbers of the run (k, m, n)."""
    names, robot = total.names, run.robot
    slope, by_number = by_parameters(robot, pose, names)
    for name, column in run.gains.columns(shown).items():
        if name in names:
            by_number[..., names.index(name)] += column
    return slope[..., list(robot.axes)], by_number


def moved_by_numbers(run: Calibrated, total: Total, pose: Array, shown: Array, whole: bool) -> Array:
    """How poses from lengths move with every number of the run, (k, d, n); of the shape alone unless `whole`."""
    slope, by_number = slopes_of(run, total, pose, shown)
    moved = np.full((len(pose), slope.shape[2], by_number.shape[2]), np.nan)
    good = np.asarray(np.isfinite(slope).all(axis=(1, 2)))
    moved[good] = -np.linalg.pinv(slope[good]) @ by_number[good]
    return moved if whole else place_best(moved, motion_field(pose[:, :3, 3])[:, list(run.robot.axes)])


def carried_covariance(run: Calibrated, pose: Array, shown: Array) -> Array:
    """Covariance (k, d, d) of poses from lengths, m and rad, of the shape alone: the base placed best over these rows."""
    assert run.knowledge is not None
    total = run.knowledge.total
    return variance_of(total, moved_by_numbers(run, total, pose, shown, False))


def place_best(slopes: Array, moved: Array) -> Array:
    """Slopes (k, r, n) less what one motion of the base makes of each, with `moved` (k, r, 6) what its motions do."""
    known = np.isfinite(slopes).all(axis=(1, 2))
    field = moved[known].reshape(-1, 6)
    motion = np.linalg.lstsq(field, slopes[known].reshape(len(field), -1), rcond=None)[0]
    return np.asarray(slopes - moved @ motion)


def variance_of(total: Total, slopes: Array) -> Array:
    """Covariances (..., r, r) of what follows by slopes (..., r, n). Root by root, so that large errors that cancel leave no rounding."""
    hidden = slopes @ total.hidden
    return np.asarray(slopes @ total.noise @ slopes.swapaxes(-1, -2) + hidden @ hidden.swapaxes(-1, -2))
