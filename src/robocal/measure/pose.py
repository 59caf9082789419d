"""Full pose: r = (p(theta) - p_y, log(R(theta) R_y^T)), in the coordinates of the instrument.

value (k, 6) is the frame vector of T_measuring_measured (m, rad), sigma (k, 6): translation, then small rotations
about the instrument's axes. A laser tracker with a 6D target, a camera that reports a marker's pose.

`options["scale"]` names an instrument that does not know how long a metre is, such as one camera without a marker of known size: its
parameter `NAME.scale` s is what it reads a metre as, r = s p - p_y.

`options["by_sight"]`: r and sigma are across and along the line from the instrument to the measured frame, not its own axes: turned by the
least rotation B of p_y to z, r = (B (p - p_y), B log(R R_y^T)). A camera's errors lie so, wherever in its image the target is.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Ints
from robocal.geometry import se3, so3
from robocal.measure.data import Observations
from robocal.measure.rows import Carriers, Kind, Number, Rows, per_target, register

__all__ = ["PARTS", "POSE", "SCALE", "SIGHT", "PoseRows", "disturb"]

SIGHT = "by_sight"  # the option of observations whose errors lie along the line of sight
PARTS = ((0, 3, "m"), (3, 6, "rad"))
SCALE = Number("scale", "scale", "1", value=1.0, expected=1.0)  # of one camera, anything


class PoseRows(Rows):
    """Residual on position and rotation vector; measured poses are kept as matrices."""

    def __init__(self, carrier: Carriers, obs: Observations, index: Ints, numbers: Ints) -> None:
        super().__init__(carrier, obs, index, numbers)
        self.matrix = np.ascontiguousarray(se3.from_vector(self.value))
        self.metric = self.metric and not len(self.numbers)
        self.share: tuple[float, float] | None = obs.options.get("robot_share")  # type: ignore[assignment]
        self.turn: Array | None = _to_sight(self.matrix[..., :3, 3]) if obs.options.get(SIGHT) else None

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        from robocal.measure._kernels import pose_kernel

        t, j, jl = self.carrier.pose(x, first, rows)
        if len(self.numbers):
            t, j, jl = self._scaled(x, t, j, jl)
        r = np.empty((*t.shape[:2], 6))
        batched = which if len(self.matrix) > 1 else np.zeros(len(x), dtype=np.int64)
        pose_kernel(t, j, jl, self.matrix, batched, first, r)
        if len(self.numbers) and self.share is not None:
            self._divide(x, r, j, jl, *self.share)
        return (r, j, jl) if self.turn is None else _turned(self.turn[batched, first : first + r.shape[1]], r, j, jl)

    def _divide(self, x: Array, r: Array, j: Array, jl: Array, share: float, usual: float) -> None:
        """Lengths by how the robot's share of their errors grows with the scale, g^2 = 1 - c + c (s / s_0)^2."""
        scale = x[:, self.numbers[0], None, None] / usual
        grown = np.sqrt(1 - share + share * scale**2)
        r[..., :3] /= grown
        j[..., :3, :] /= grown[..., None]
        jl[..., :3, :] /= grown[..., None]
        if len(self.own):
            j[..., :3, -1] -= r[..., :3] * share * scale / (usual * grown**2)

    def _scaled(self, x: Array, t: Array, j: Array, jl: Array) -> tuple[Array, Array, Array]:
        """A pose with its columns, as an instrument of this scale reads it; the last column is the scale's, where it is free."""
        scale = x[:, self.numbers[0], None, None]
        own = np.zeros((*j.shape[:-1], len(self.own)))
        own[..., :3, :] = t[..., :3, 3:]
        t, j, jl = np.array(t), np.concatenate([j, own], axis=3), np.array(jl)
        t[..., :3, 3] *= scale
        j[..., :3, : j.shape[3] - len(self.own)] *= scale[..., None]
        jl[..., :3, :] *= scale[..., None]
        return t, j, jl

    def predict(self, x: Array) -> Array:
        carrier = self.carrier.bind(np.full(x.shape[1], -1, dtype=np.int64))
        t = carrier.pose(x, 0, len(self.configuration))[0]
        if len(self.numbers):
            t = np.array(t)
            t[..., :3, 3] *= x[:, self.numbers[0], None, None]
        return se3.to_vector(t[0])


def _to_sight(place: Array) -> Array:
    """The least rotation (..., 3, 3) that turns places (..., 3) to z."""
    far = np.linalg.norm(place, axis=-1, keepdims=True)
    ahead = place / np.where(far > 0, far, 1.0)
    x, y, z = np.moveaxis(ahead, -1, 0)
    near = np.maximum(1 + z, np.finfo(float).tiny)
    rows = ((1 - x * x / near, -x * y / near, -x), (-x * y / near, 1 - y * y / near, -y), (x, y, z))
    return np.where(far[..., None] > 0, np.moveaxis(np.array(rows), (0, 1), (-2, -1)), np.eye(3))


def _turned(by: Array, r: Array, j: Array, jl: Array) -> tuple[Array, Array, Array]:
    """Both halves of residuals (b, m, 6) and of columns (b, m, 6, n), turned by rotations (b, m, 3, 3)."""
    return _turn(by, r), _turn(by, j), _turn(by, jl)


def _turn(by: Array, part: Array) -> Array:
    columns = part.reshape(*part.shape[:2], 2, 3, int(np.prod(part.shape[3:])))
    return np.asarray(np.einsum("bmij,bmhjn->bmhin", by, columns).reshape(part.shape))


def disturb(value: Array, noise: Array) -> Array:
    """Noise on the translation is added; on the rotation it turns about the instrument's axes."""
    r = so3.exp(noise[..., 3:]) @ so3.exp(value[..., 3:])
    return np.concatenate([value[..., :3] + noise[..., :3], so3.log(r)], axis=-1)


POSE = register(
    Kind("pose", 6, per_target(PoseRows), parts=PARTS, disturb=disturb, numbers=(SCALE,), positional=True, metric=True)
)
