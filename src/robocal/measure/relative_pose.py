"""Relative pose of two configurations: Y = T_first_second = (T_base_m(first))^-1 T_base_m(second).

value (k, 6) is the frame vector of Y (m, rad), sigma (k, 6): translation, then small rotations about the axes of the
measured frame m at the first configuration. m is the target (default: the tool). There is no instrument frame: an
inertial unit, visual odometry, or a tracker of which only differences are trusted. Base and instrument cancel, so
neither is seen. Source: the residual is the one of `pose`.
"""

from __future__ import annotations

from robocal._types import Ints
from robocal.measure.builder import Builder
from robocal.measure.carriers import Inverse, Product
from robocal.measure.data import Observations
from robocal.measure.pose import PARTS, SCALE, PoseRows, disturb
from robocal.measure.rows import Kind, per_target, register

__all__ = ["RELATIVE_POSE"]


def change(builder: Builder, obs: Observations, target: int, index: Ints) -> Product:
    """T_first_second of a target."""
    first = builder.target(obs, target, obs.configuration[index], index)
    return Product(Inverse(first), builder.target(obs, target, builder.second(obs, index), index))


RELATIVE_POSE = register(
    Kind("relative_pose", 6, per_target(PoseRows, change), parts=PARTS, disturb=disturb, numbers=(SCALE,), metric=True)
)
