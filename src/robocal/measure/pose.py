"""Kinds that read where the target is, whole or in part, and how that changes between configurations.

Full pose: r = (p(theta) - p_y, log(R(theta) R_y^T)), in the coordinates of the instrument.

value (k, 6) is the frame vector of T_measuring_measured (m, rad), sigma (k, 6): translation, then small rotations
about the instrument's axes. A laser tracker with a 6D target, a camera that reports a marker's pose.

Position of a point: r = p(theta) - y, in the coordinates of the instrument.

value (k, 3) and sigma (k, 3) in m. A laser tracker with a reflector, a stereo camera with a ball; with value zero in
a frame that may only shift it is a ball that rests in one socket.

Displacement between two configurations: r = R_frame_base (p(second) - p(first)) - y.

value (k, 3) and sigma (k, 3) in m, in the axes of the instrument's frame (without one: of the base); only its rotation
is seen. An instrument that was moved between runs, a 3D camera or a laser that reports changes: where it stands cancels.
Noise is that of the difference: twice the variance of one reading, and rows that share a configuration share its error.

Relative pose of two configurations: Y = T_first_second = (T_base_m(first))^-1 T_base_m(second).

value (k, 6) is the frame vector of Y (m, rad), sigma (k, 6): translation, then small rotations about the axes of the
measured frame m at the first configuration. m is the target (default: the tool). There is no instrument frame: an
inertial unit, visual odometry, or a tracker of which only differences are trusted. Base and instrument cancel, so
neither is seen. Source: the residual is the one of `pose`.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Ints
from robocal.geometry import se3, so3
from robocal.measure.builder import Builder
from robocal.measure.carriers import Carrier, Inverse, Product
from robocal.measure.data import Observations
from robocal.measure.rows import Between, Carriers, Kind, Rows, per_target, register

__all__ = ["DISPLACEMENT", "POSE", "POSITION", "RELATIVE_POSE"]

# --- pose -------------------------------------------------------------------------------------------------------------

PARTS = ((0, 3, "m"), (3, 6, "rad"))


class PoseRows(Rows):
    """Residual on position and rotation vector; measured poses are kept as matrices."""

    def __init__(self, carrier: Carriers, obs: Observations, index: Ints, numbers: Ints) -> None:
        super().__init__(carrier, obs, index, numbers)
        self.matrix = np.ascontiguousarray(se3.from_vector(self.value))

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        from robocal.measure._kernels import pose_kernel

        t, j, jl = self.carrier.pose(x, first, rows)
        r = np.empty((*t.shape[:2], 6))
        batched = which if len(self.matrix) > 1 else np.zeros(len(x), dtype=np.int64)
        pose_kernel(t, j, jl, self.matrix, batched, first, r)
        return r, j, jl

    def predict(self, x: Array) -> Array:
        carrier = self.carrier.bind(np.full(x.shape[1], -1, dtype=np.int64))
        return se3.to_vector(carrier.pose(x, 0, len(self.configuration))[0][0])


def disturb(value: Array, noise: Array) -> Array:
    """Noise on the translation is added; on the rotation it turns about the instrument's axes."""
    r = so3.exp(noise[..., 3:]) @ so3.exp(value[..., 3:])
    return np.concatenate([value[..., :3] + noise[..., :3], so3.log(r)], axis=-1)


POSE = register(Kind("pose", 6, per_target(PoseRows), parts=PARTS, disturb=disturb, positional=True, metric=True))


# --- position ---------------------------------------------------------------------------------------------------------


class PositionRows(Rows):
    """Residual p - y; the Jacobian is the upper half of the carrier's."""

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        t, j, jl = self.carrier.pose(x, first, rows, turn=False)
        return t[:, :, :3, 3] - self.values_at(which, first, rows), j, jl


POSITION = register(Kind("position", 3, per_target(PositionRows), positional=True, metric=True))


# --- displacement -----------------------------------------------------------------------------------------------------


class DisplacementRows(Between):
    """The vector between two places: of the target, seen from one instrument."""

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        d, j, jl = self.gap(x, first, rows)
        return d - self.values_at(which, first, rows), j, jl


def views(builder: Builder, obs: Observations, target: int, index: Ints) -> tuple[Carrier, Carrier]:
    """The target at both configurations, as the instrument sees it."""
    return builder.view(obs, target, index), builder.view(obs, target, index, second=True)


DISPLACEMENT = register(Kind("displacement", 3, per_target(DisplacementRows, views), metric=True))


# --- relative pose ----------------------------------------------------------------------------------------------------


def change(builder: Builder, obs: Observations, target: int, index: Ints) -> Product:
    """T_first_second of a target."""
    first = builder.target(obs, target, obs.configuration[index], index)
    return Product(Inverse(first), builder.target(obs, target, builder.second(obs, index), index))


RELATIVE_POSE = register(
    Kind("relative_pose", 6, per_target(PoseRows, change), parts=PARTS, disturb=disturb, metric=True)
)
