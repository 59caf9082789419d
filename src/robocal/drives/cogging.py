"""Cogging: what a rotor asks for at every angle, as harmonics of the turn.

    c(theta, d) = sum_n (a_n + d a'_n) cos(n u) + (b_n + d b'_n) sin(n u),    u = theta + e_c cos(theta) + e_s sin(theta) - d L

theta is the angle that the encoder shows (rad), d the direction of motion (1, -1; 0 at standstill: the mean of both). The lag L shifts
the curve of each direction the way that it moves. a' and b' are phases per direction, and zero where one lag does for both. An encoder
disc that is off its centre shows theta for u: two numbers, in place of sidebands at n - 1 and n + 1. Values are torque or current (N m, A).
Source: seed document, 1.3 and 1.4.2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import cached_property, record
from robocal._types import Array

__all__ = ["Cogging", "harmonics"]


def harmonics(angle: ArrayLike, orders: ArrayLike) -> Array:
    """cos(n angle) for every order, then sin(n angle): (..., 2 n) from angles (...) in rad."""
    turns = np.asarray(angle, float)[..., None] * np.asarray(orders, float)
    return np.concatenate([np.cos(turns), np.sin(turns)], axis=-1)


@record
class Cogging:
    """Harmonics of one motor: `orders` per turn, cosine and sine parts of each, the lag (rad), what each direction adds to the parts
    (none where both are alike), and the two numbers of an eccentric encoder disc (rad)."""

    orders: tuple[int, ...] = ()
    cosine: tuple[float, ...] = ()
    sine: tuple[float, ...] = ()
    lag: float = 0.0
    cosine_change: tuple[float, ...] = ()
    sine_change: tuple[float, ...] = ()
    eccentric: tuple[float, float] = (0.0, 0.0)

    @cached_property
    def amplitudes(self) -> Array:
        """The amplitude of every order, (n,), of the mean of both directions."""
        return np.hypot(self.cosine, self.sine)

    @cached_property
    def phases(self) -> Array:
        """The phase of every order, (n,) rad: a cos(n u) + b sin(n u) = A cos(n u - phase)."""
        return np.arctan2(self.sine, self.cosine)

    @property
    def by_direction(self) -> bool:
        """Whether the directions have phases of their own."""
        return bool(self.cosine_change)

    def at(self, angle: ArrayLike, direction: ArrayLike = 0.0) -> Array:
        """The curve at angles (...), moved to in directions (...): 1, -1, or 0."""
        theta, d = np.broadcast_arrays(np.asarray(angle, float), np.asarray(direction, float))
        e_c, e_s = self.eccentric
        u = theta + e_c * np.cos(theta) + e_s * np.sin(theta) - d * self.lag
        out = np.zeros(theta.shape)
        # Order by order: a table of all of them at once would be forty times as large as the curve.
        for i, n in enumerate(self.orders):
            a, b = self.cosine[i], self.sine[i]
            if self.by_direction:
                out += (a + d * self.cosine_change[i]) * np.cos(n * u) + (b + d * self.sine_change[i]) * np.sin(n * u)
            else:
                out += a * np.cos(n * u) + b * np.sin(n * u)
        return out
