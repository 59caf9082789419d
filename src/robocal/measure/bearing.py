"""Bearing of a target: r = (atan2(y, x), atan2(z, hypot(x, y))) - value, wrapped, of p in the instrument's frame.

value (k, 2) and sigma (k, 2) in rad: azimuth about the instrument's z from its x axis, elevation above its xy plane, as
the circles are read. One or two theodolites, each with its own frame; one alone sees no scale but the arm's own. Do not
point near the instrument's z axis: azimuth has no meaning there.
Source: Whitney, Lozinski and Rourke, Industrial robot forward calibration method and results (1986).
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Ints
from robocal.measure.rows import Kind, Rows, per_target, register

__all__ = ["BEARING", "angles", "directions", "wrap"]

TINY = 1e-300


def wrap(angle: Array) -> Array:
    """The same angles in [-pi, pi)."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


def angles(p: Array) -> tuple[Array, Array]:
    """Azimuth and elevation (..., 2) of points (..., 3), and the gradient (..., 2, 3)."""
    x, y, z = p[..., 0], p[..., 1], p[..., 2]
    flat2 = np.maximum(x * x + y * y, TINY)
    flat = np.sqrt(flat2)
    far2 = flat2 + z * z
    zero = np.zeros_like(x)
    by_azimuth = np.stack([-y / flat2, x / flat2, zero], axis=-1)
    by_elevation = np.stack([-x * z / (flat * far2), -y * z / (flat * far2), flat / far2], axis=-1)
    return np.stack([np.arctan2(y, x), np.arctan2(z, flat)], axis=-1), np.stack([by_azimuth, by_elevation], axis=-2)


def directions(angle: Array) -> Array:
    """Unit vectors (..., 3) of azimuth and elevation (..., 2)."""
    a, e = angle[..., 0], angle[..., 1]
    return np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], axis=-1)


class BearingRows(Rows):
    """The two angles of the target's place."""

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        t, j, jl = self.carrier.pose(x, first, rows, turn=False)
        found, slope = angles(t[:, :, :3, 3])
        return wrap(found - self.values_at(which, first, rows)), slope @ j, slope @ jl


BEARING = register(Kind("bearing", 2, per_target(BearingRows), parts=((0, 2, "rad"),)))
