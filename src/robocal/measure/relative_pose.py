"""Relative pose of two configurations: Y = T_first_second = (T_base_m(first))^-1 T_base_m(second).

value (k, 6) is the frame vector of Y (m, rad), sigma (k, 6): translation, then small rotations about the axes of the
measured frame m at the first configuration. m is the target (default: the tool). There is no instrument frame: an
inertial unit, visual odometry, or a tracker of which only differences are trusted. Base and instrument cancel, so
neither is seen. Source: the residual is the one of `pose`.
"""

from __future__ import annotations

from robocal.measure.builder import Builder
from robocal.measure.carriers import Inverse, Product
from robocal.measure.data import Observations
from robocal.measure.pose import UNSTATED, PoseRows, disturb
from robocal.measure.rows import Kind, Rows, register

__all__ = ["RELATIVE_POSE"]


def terms(builder: Builder, obs: Observations) -> list[Rows]:
    """One term per target."""
    out: list[Rows] = []
    for t, index in builder.split(obs):
        first = builder.target(obs, t, obs.configuration[index], index)
        second = builder.target(obs, t, builder.second(obs, index), index)
        out.append(PoseRows(Product(Inverse(first), second), obs, index, UNSTATED))
    return out


RELATIVE_POSE = register(
    Kind("relative_pose", 6, terms, parts=((0, 3, "m"), (3, 6, "rad")), disturb=disturb, metric=True)
)
