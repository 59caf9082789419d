"""Predicted places of the tool anywhere, and how far they may be off.

    e(q) = (J(q) - M(q) K) dx,    K = argmin over sampled q of sum |J_p(q) - M_p(q) K|^2

dx is what the parameters may be off by (`Total`), J the Jacobian of the tool frame in base coordinates, M(q) the six
motions of the base as a whole. Where the base stands is the instrument's to say and no property of the arm: with a free
instrument frame its error cannot be told from that of the first joint, and would drown every other. So the rigid motion
that undoes most of each parameter over the workspace is taken out; what is left is the error of the shape. With
`motion` None nothing is taken out.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import record
from robocal._types import Array
from robocal.estimate.uncertainty import Total
from robocal.geometry import so3
from robocal.measure.machine import Model
from robocal.measure.reach import limits_of, reach

__all__ = ["Predicted", "base_motion", "between", "motion_field", "predict", "sample_joints"]

CHUNK = 1024  # configurations whose Jacobian is held at once
TURN = np.pi  # to either side, where nothing bounds a joint


@record
class Predicted:
    """Poses T_base_tool (m, 4, 4) and covariance (m, 6, 6) of position (m) and turn (rad), in base axes; (m, 3, 3) where
    the turn was not asked for."""

    pose: Array
    covariance: Array

    @property
    def position(self) -> Array:
        """Covariance of the position, (m, 3, 3)."""
        return self.covariance[:, :3, :3]

    @property
    def turn(self) -> Array:
        """Covariance of the orientation, (m, 3, 3)."""
        return self.covariance[:, 3:, 3:]


def sample_joints(chain: Model, measured: Array | None, count: int, seed: int = 0) -> tuple[Array, str]:
    """Joint values (count, n) drawn within the joint limits, the measured range (n, 2) where a limit is infinite; and
    the name of that region."""
    low, high = limits_of(chain).T
    fallback = np.tile([-TURN, TURN], (len(low), 1)) if measured is None else measured
    finite = np.isfinite(low) & np.isfinite(high)
    low, high = np.where(np.isfinite(low), low, fallback[:, 0]), np.where(np.isfinite(high), high, fallback[:, 1])
    region = "joint limits" if finite.all() else "joint limits, or the measured range where there are none"
    return between(np.stack([low, high], axis=1), count, seed), region


def between(ranges: Array, count: int, seed: int = 0) -> Array:
    """Joint values (count, n) drawn within ranges (n, 2)."""
    drawn = np.random.default_rng(seed).random((count, len(ranges)))
    drawn *= ranges[:, 1] - ranges[:, 0]
    drawn += ranges[:, 0]
    return drawn


def motion_field(points: Array) -> Array:
    """What the six motions (v, w) of the base do to frames at points (m, 3): (m, 6, 6), p' = v + w x p, turn w."""
    out = np.zeros((len(points), 6, 6))
    out[:, :3, :3] = out[:, 3:, 3:] = np.eye(3)
    out[:, :3, 3:] = -so3.skew(points)
    return out


def base_motion(jacobian: Array, points: Array) -> Array:
    """K (6, k): the motion of the base that undoes most of each column of J (m, 6, k) at points (m, 3)."""
    field = motion_field(points)[:, :3].reshape(-1, 6)
    return np.asarray(np.linalg.lstsq(field, jacobian[:, :3].reshape(len(field), -1), rcond=None)[0])


def parameters_of(chain: Model, total: Total) -> tuple[str, ...]:
    """The names of `total` that belong to the arm."""
    return tuple(n for n in total.names if n in chain.table)


def predict(
    chain: Model, joints: Array, total: Total, conditions: Mapping[str, ArrayLike], motion: Array | None = None,
    *, turn: bool = True,
) -> Predicted:  # fmt: skip
    """The tool's pose at joint values (m, n) with its covariance; `conditions` are the other columns that the model
    needs, `motion` (6, k) comes from `base_motion` for the arm's names of `total`. Without `turn` of the position alone, at
    half the price."""
    joints, names = np.atleast_2d(joints), parameters_of(chain, total)
    at = [total.names.index(n) for n in names]
    hidden, known = total.hidden[at], total.noise[np.ix_(at, at)]
    fitted = np.flatnonzero(known.any(axis=0))
    parts = np.hstack([known[:, fitted], hidden[:, hidden.any(axis=0)]])
    high = 6 if turn else 3
    pose, covariance = np.empty((len(joints), 4, 4)), np.empty((len(joints), high, high))
    for first in range(0, len(joints), CHUNK):
        some = slice(first, first + CHUNK)
        here = {k: np.broadcast_to(np.asarray(v, float), len(joints))[some] for k, v in conditions.items()}
        pose[some], jac = reach(chain, joints[some], names, here, turn=turn)
        if motion is not None:
            jac -= _times(motion_field(pose[some, :3, 3])[:, :high], motion)
        # What is hidden root by root, so that large errors that cancel leave no rounding below zero.
        left = _times(jac, parts)
        right = left.copy()
        right[..., : len(fitted)] = jac[..., fitted]
        covariance[some] = left @ np.swapaxes(right, 1, 2)
    return Predicted(pose, covariance)


def _times(many: Array, one: Array) -> Array:
    """(m, r, k) times (k, l) as one product of matrices: numpy would make m small ones of it."""
    return (many.reshape(-1, many.shape[-1]) @ one).reshape(*many.shape[:-1], -1)
