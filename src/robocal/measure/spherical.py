"""A laser tracker in its own coordinates: r = (|p| - zero, azimuth, elevation) - value, of p in the instrument's frame.

value (k, 3): range in m, azimuth and elevation in rad (as for `bearing`), sigma (k, 3) each in its own unit. `options["zero"]`
names the zero of the ranges, whose parameter `NAME.zero` (m) adds to the reading (a prism's constant, a distance meter's). Range is
known to micrometres and angles to microradians: at some metres the point is known far better along the beam than
across it, which a position with one sigma cannot say.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Ints
from robocal.measure.bearing import angles, wrap
from robocal.measure.rows import Kind, Number, Rows, per_target, register

__all__ = ["SPHERICAL"]


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
