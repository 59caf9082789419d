"""Inclination of a target: r = asin(u_i) - y, i = x, y, with u = R^T e_z the direction of plumb, upwards, in the target's axes.

value (k, 2) and sigma (k, 2) in rad: by how much the target's x axis and its y axis rise above the horizon, as a two-axis
inclinometer reads. R turns the target's axes into those of the instrument's frame, whose z is up; without a frame it is the base's.
How the sensor sits on the platform is its target's rotation, of which x, y and z are all seen. Turning about plumb is not seen.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Ints
from robocal.measure.rows import Kind, Rows, per_target, register

__all__ = ["INCLINATION", "inclinations"]

STEEPEST = 1 - 1e-12  # an axis that points along plumb has no slope there


def inclinations(turn: Array) -> tuple[Array, Array]:
    """Angles (..., 2) of rotations (..., 3, 3), and their gradient (..., 2, 3) by a small rotation in the frame's axes."""
    u = np.clip(turn[..., 2, :2], -STEEPEST, STEEPEST)
    zero = np.zeros_like(u)
    # d(R^T e_z)_i = w x (column i) . e_z
    slope = np.stack([turn[..., 1, :2], -turn[..., 0, :2], zero], axis=-1) / np.sqrt(1 - u * u)[..., None]
    return np.arcsin(u), slope


class InclinationRows(Rows):
    """The two angles of the target's axes."""

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        t, j, jl = self.carrier.pose(x, first, rows)
        found, slope = inclinations(t[..., :3, :3])
        return found - self.values_at(which, first, rows), slope @ j[:, :, 3:], slope @ jl[:, :, 3:]


INCLINATION = register(Kind("inclination", 2, per_target(InclinationRows), parts=((0, 2, "rad"),), unstated=1e-3))
