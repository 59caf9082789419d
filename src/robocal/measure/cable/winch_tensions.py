"""Tensions of cables from currents of their winches, as numbers of a problem: t = (n / R) (k i + c sgn(v) + b n v / R).

k is the torque constant of all motors, c and b the friction of each (`measure/winches.py`), i the current and v the speed of the cable.
"""

from __future__ import annotations

from typing import Self

import numpy as np

from robocal._record import record
from robocal._types import Array, Ints
from robocal.measure.builder import Builder
from robocal.measure.cable.cable_names import cable_names
from robocal.measure.data import Observations

__all__ = ["FRICTION", "KT", "RATIO", "WinchTensions", "friction_columns", "ratio_of", "winch_names"]

KT, FRICTION = "kt", ("coulomb", "viscous")
RATIO = "ratio"  # of a gear by the radius of its drum, 1/m: stated, and kept with what was found
WHAT = "a winch for every cable"


def winch_names(obs: Observations) -> list[str]:
    """The parameters of all winches: the torque constant, then friction cable by cable."""
    own = str(obs.options["winches"])
    return [f"{own}.{KT}", *(f"{own}.{c}.{s}" for c in cable_names(obs, WHAT) for s in FRICTION)]


def ratio_of(obs: Observations) -> float:
    """By what a motor's torque is multiplied to a tension, 1/m."""
    found = obs.options.get("ratio")
    assert isinstance(found, float)
    return found


def friction_columns(obs: Observations, current: Array, speed: Array) -> tuple[Array, Array, Array]:
    """What k, c and b of each winch multiply to tensions, (..., m) each, of currents and speeds (..., m)."""
    ratio = ratio_of(obs)
    return ratio * current, ratio * np.sign(speed), ratio * ratio * speed


@record(eq=False)
class WinchTensions:
    """Tensions of some rows as a linear function of the numbers `names`, by `columns` (m, n)."""

    names: tuple[str, ...]
    columns: Array

    @classmethod
    def of(cls, builder: Builder, obs: Observations, index: Ints, cable: Ints) -> Self:
        """Those of rows of cables (m,); of none where tensions are known, or nobody asks."""
        if not obs.options.get("winches") or "current" not in obs.extra:
            return cls((), np.empty((len(index), 0)))
        names, rows = winch_names(obs), np.arange(len(index))
        columns = np.zeros((len(index), len(names)))
        by_k, by_c, by_b = friction_columns(obs, obs.extra["current"][index], obs.extra["speed"][index])
        columns[:, 0], columns[rows, 1 + 2 * cable], columns[rows, 2 + 2 * cable] = by_k, by_c, by_b
        return cls(tuple(names), columns)

    def at(self, values: Array) -> Array:
        """Tensions (m,) in N of all rows."""
        return np.asarray(self.columns @ values)
