"""Kinds that read angles.

Bearing of a target: r = (atan2(y, x), atan2(z, hypot(x, y))) - value, wrapped, of p in the instrument's frame.

value (k, 2) and sigma (k, 2) in rad: azimuth about the instrument's z from its x axis, elevation above its xy plane, as
the circles are read. One or two theodolites, each with its own frame; one alone sees no scale but the arm's own. Do not
point near the instrument's z axis: azimuth has no meaning there.
Source: Whitney, Lozinski and Rourke, Industrial robot forward calibration method and results (1986).

A laser tracker in its own coordinates: r = (|p| - zero, azimuth, elevation) - value, of p in the instrument's frame.

value (k, 3): range in m, azimuth and elevation in rad (as for `bearing`), sigma (k, 3) each in its own unit. `options["zero"]`
names the zero of the ranges, whose parameter `NAME.zero` (m) adds to the reading (a prism's constant, a distance meter's). Range is
known to micrometres and angles to microradians: at some metres the point is known far better along the beam than
across it, which a position with one sigma cannot say.

Inclination of a target: r = asin(u_i) - y, i = x, y, with u = R^T e_z the direction of plumb, upwards, in the target's axes.

value (k, 2) and sigma (k, 2) in rad: by how much the target's x axis and its y axis rise above the horizon, as a two-axis
inclinometer reads. R turns the target's axes into those of the instrument's frame, whose z is up; without a frame it is the base's.
How the sensor sits on the platform is its target's rotation, of which x, y and z are all seen. Turning about plumb is not seen.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Ints
from robocal.measure.rows import Kind, Number, Rows, per_target, register

__all__ = ["BEARING", "INCLINATION", "SPHERICAL", "angles", "directions", "inclinations", "wrap"]

# --- bearing ----------------------------------------------------------------------------------------------------------

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


# --- spherical --------------------------------------------------------------------------------------------------------


class SphericalRows(Rows):
    """Range and the two angles of the target's place; its error is the distance between the two places."""

    @property
    def lever(self) -> Array:
        """An angle is worth the arc that it spans: 1, |p| cos(elevation), |p|, (m, 3)."""
        far, up = self.value[0, :, 0], self.value[0, :, 2]
        return np.stack([np.ones_like(far), far * np.cos(up), far], axis=1)

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        t, j, jl = self.carrier.pose(x, first, rows, turn=False)
        p = t[:, :, :3, 3]
        far = np.linalg.norm(p, axis=-1, keepdims=True)
        turned, slope = angles(p)
        slope = np.concatenate([(p / np.where(far > 0, far, 1.0))[..., None, :], slope], axis=-2)
        r = np.concatenate([far, turned], axis=-1) - self.values_at(which, first, rows)
        r[..., 0] -= x[:, self.numbers].sum(axis=1)[:, None]
        r[..., 1:] = wrap(r[..., 1:])
        own = np.zeros((*r.shape, len(self.own)))
        own[:, :, 0] = -1.0
        return r, np.concatenate([slope @ j, own], axis=-1), slope @ jl


NUMBERS = (Number("zero", "zero", expected=1e-3),)
PARTS = ((0, 1, "m"), (1, 3, "rad"))
SPHERICAL = register(
    Kind("spherical", 3, per_target(SphericalRows), parts=PARTS, metric=True, owner="zero", numbers=NUMBERS)
)


# --- inclination ------------------------------------------------------------------------------------------------------

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
