"""A motor as it truly is: inertia, friction with a bristle, cogging with hysteresis, and its encoder.

    J dw/dt = torque - friction - cogging(a)
    friction = s z + r dz/dt + v w        dz/dt = w - s |w| z / g(w)        g(w) = F_c + (F_b - F_c) exp(-(w / w_s)^2)

Friction is the model of LuGre: z is the bending of bristles of stiffness s. While the rotor turns it is F_c + v w; below the breakaway
torque the bristles hold the rotor like a spring. Where r is not given, it is sqrt(s J), as in the paper of the model. The cogging's angle
a follows the rotor with play: `cogging.lag` behind it, whichever way it turns. So there is one lag, and no energy comes from nothing.
Source: seed document, chapter 1; C. Canudas de Wit et al., A new model for control of systems with friction, IEEE TAC 40 (1995).
"""

from __future__ import annotations

import math

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.drives.cogging import Cogging
from robocal.errors import require

__all__ = ["MotorPlant"]


POSITIVE = (
    "inertia", "torque_constant", "coulomb", "breakaway", "stribeck_speed", "bristle_stiffness", "current_limit",
)  # fmt: skip


@record
class MotorPlant:
    """Inertia (kg m2), torque constant (N m/A), cogging (N m), Coulomb and breakaway torque (N m), Stribeck speed (rad/s), viscous
    coefficient (N m s), stiffness (N m/rad) and damping of the bristles, largest current (A), encoder counts per turn (0: exact).

    Raises ModelError for numbers that no motor has, and for a cogging that differs by direction in more than its lag.
    """

    inertia: float
    torque_constant: float
    cogging: Cogging
    coulomb: float
    breakaway: float
    stribeck_speed: float
    viscous: float
    bristle_stiffness: float
    bristle_damping: float | None = None
    current_limit: float = math.inf
    counts: int = 0
    offset: float = 0.0

    def __post_init__(self) -> None:
        for key in POSITIVE:
            value = getattr(self, key)
            require(value > 0, "not above zero", key=key, found=value, expected="above 0")
        require(self.viscous >= 0, "not 0 or more", key="viscous", found=self.viscous, expected="0 or more")
        ordered = self.breakaway >= self.coulomb
        expected = "at least the Coulomb torque"
        require(ordered, "the breakaway torque is too small", key="breakaway", found=self.breakaway, expected=expected)
        plain = not self.cogging.by_direction and self.cogging.eccentric == (0.0, 0.0)
        require(
            plain, "the cogging of a simulated motor has one lag alone", key="cogging", expected="orders, parts and lag"
        )

    @property
    def torque_limit(self) -> float:
        """The torque of the largest current."""
        return self.torque_constant * self.current_limit

    @property
    def array(self) -> Array:
        """Its numbers in the order of `run_motor`."""
        damping = self.bristle_damping
        if damping is None:
            damping = math.sqrt(self.bristle_stiffness * self.inertia)
        return np.array([
            self.inertia, self.coulomb, self.breakaway, self.stribeck_speed, self.viscous, self.bristle_stiffness, damping,
            self.cogging.lag, self.offset, self.torque_limit, self.counts,
        ])  # fmt: skip
