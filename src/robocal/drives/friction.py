"""Friction of a motor: f(w) = Coulomb sgn(w) + viscous w, in N m (or A) and N m s/rad (or A s/rad)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import record
from robocal._types import Array

__all__ = ["Friction"]


@record
class Friction:
    """What a motor asks for to be moved at all, and to be moved faster."""

    coulomb: float = 0.0
    viscous: float = 0.0

    def at(self, speed: ArrayLike, direction: ArrayLike | None = None) -> Array:
        """Friction at speeds (...) in rad/s, of the same sign; `direction` (1, -1, 0) where the speed is too small to have one."""
        w = np.asarray(speed, float)
        sign = np.sign(w) if direction is None else np.asarray(direction, float)
        return np.asarray(self.coulomb * sign + self.viscous * w)
