"""Whether tensions that were read hold a platform: what they weigh, what they leave, and which column or row stands wrong.

    W_j t_j + m g_j + (R_j m c) x g = 0      in the freedoms of the platform, linear in m and m c

With the geometry as stated, a few centimetres off, a tension pulls a hundredth off its direction: only what is far beyond that counts.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.diagnose.limits import TENSION_CLEARLY, TENSION_DIRECTIONS

__all__ = ["Balance", "balance"]

SHIFTS = (-3, -2, -1, 1, 2, 3)


@dataclass(frozen=True)
class Balance:
    """What tensions of a platform at rest weigh, kg, the force that they leave, rms N, and the force that directions which are a tenth off
    would; `exchanged` are two cables whose readings, changed over, leave far less, `shifted` the number of rows by which all are late."""

    mass: float
    left: float
    allowed: float
    exchanged: tuple[int, int] | None = None
    shifted: int | None = None

    @property
    def plausible(self) -> bool:
        """Whether what is left may be that of the geometry."""
        return self.left <= self.allowed


def balance(robot: CableRobot, poses: ArrayLike, tensions: ArrayLike) -> Balance:
    """Of poses (k, 4, 4) and tensions (k, m) in N."""
    t, pull = np.asarray(poses, float), np.asarray(tensions, float)
    w, unit = structure_of(robot, t), _by_body(robot, t)
    mass, left = _left(w, unit, pull)
    allowed = TENSION_DIRECTIONS * float(np.sqrt(np.mean(np.sum(pull**2, axis=1))))
    exchanged = shifted = None
    if left > allowed:
        tried = {
            pair: _left(w, unit, _exchange_columns(pull, *pair))[1] for pair in combinations(range(pull.shape[1]), 2)
        }
        late = {by: _left(w, unit, np.roll(pull, by, axis=0))[1] for by in SHIFTS if len(pull) > 2 * abs(by)}
        pair, row = min(tried, key=tried.__getitem__), min(late, key=late.__getitem__, default=None)
        if tried[pair] < TENSION_CLEARLY * left:
            exchanged = pair
        elif row is not None and late[row] < TENSION_CLEARLY * left:
            shifted = -row
    return Balance(mass, left, allowed, exchanged, shifted)


def _by_body(robot: CableRobot, poses: Array) -> Array:
    """Wrench (k, d, 4) by the mass and by mass times centre of mass."""
    rows = list(robot.axes)
    still = gravity_wrench(poses, 1.0, np.zeros(3))
    return np.stack([still, *(gravity_wrench(poses, 1.0, e) - still for e in np.eye(3))], axis=-1)[:, rows]


def _exchange_columns(pull: Array, i: int, j: int) -> Array:
    out = pull.copy()
    out[:, [i, j]] = pull[:, [j, i]]
    return out


def _left(w: Array, unit: Array, pull: Array) -> tuple[float, float]:
    """Mass and the rms of the force that is left, of the best mass and centre of mass."""
    wrench = np.einsum("kdm,km->kd", w, pull)
    body = np.linalg.lstsq(unit.reshape(-1, 4), -wrench.ravel(), rcond=1e-9)[0]
    left = wrench + unit @ body
    moves = left.shape[1] if left.shape[1] < 3 else 3 if left.shape[1] == 6 else 2
    return float(body[0]), float(np.sqrt(np.mean(np.sum(left[:, :moves] ** 2, axis=1))))
