"""Torques at the joints of an arm that stands or moves slowly: r = gravity(q) + c sgn(q') + b q' - y, one row per joint and configuration.

value (k, 1) in N m (N where a joint slides), extra["joint"] (k,) the joint's number from 0, extra["speed"] (k,) its speed in rad/s or m/s.
The numbers are the arm's own (`arms/joint_loads.py`): masses and first moments of links, Coulomb and viscous friction of joints.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Ints
from robocal.arms.chain import Chain
from robocal.arms.joint_loads import GRAVITY_SYMBOLS, LOAD_SYMBOLS, gravity_columns, load_names
from robocal.errors import ModelError
from robocal.measure.builder import Builder
from robocal.measure.data import Observations
from robocal.measure.rows import Kind, Rows, register

__all__ = ["JOINT_TORQUE"]


class JointTorqueRows(Rows):
    """The rows of all joints, linear in the numbers of links and joints: their columns are computed once."""

    reading = True

    def __init__(self, builder: Builder, obs: Observations) -> None:
        arm = builder.machine.part(Chain)
        if arm is None or builder.configurations.joints is None:
            raise ModelError(
                "torques at joints are of an arm", key=obs.label, found=builder.machine.name, expected="kind: arm"
            )
        super().__init__((), obs, np.arange(len(obs)), builder.rows(load_names(arm)))
        where, which = np.unique(obs.configuration, return_inverse=True)
        known = {k: v[where] for k, v in builder.configurations.columns.items()}
        every = gravity_columns(arm, builder.configurations.joints[where], known)
        joint, rows = obs.extra["joint"].astype(np.int64), np.arange(len(obs))
        columns = np.zeros((len(obs), len(arm.joints), len(LOAD_SYMBOLS)))
        columns[:, :, : len(GRAVITY_SYMBOLS)] = every[which.ravel(), joint]
        columns[rows, joint, -2], columns[rows, joint, -1] = np.sign(obs.extra["speed"]), obs.extra["speed"]
        self.slopes = columns.reshape(len(obs), -1)

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        slopes = self.slopes[first : first + rows]
        r = (x[:, self.numbers] @ slopes.T)[..., None] - self.values_at(which, first, rows)
        jac = np.broadcast_to(slopes[:, None, self.own], (len(x), rows, 1, len(self.own)))
        return r, jac.copy(), np.zeros((*r.shape, 0))


def terms(builder: Builder, obs: Observations) -> list[Rows]:
    """One term for all joints."""
    return [JointTorqueRows(builder, obs)] if len(obs) else []


JOINT_TORQUE = register(Kind("joint_torque", 1, terms, parts=((0, 1, "N m"),), unstated=0.1))
