"""What a drum winds up, beyond where its sensor counts from, when that shows y: l = g y + q y^2.

A cable in one layer lies on a helix of constant radius: its gain g is all there is. A cable that lies on itself makes the drum larger
with every turn, by q y^2; q (1/m) is thickness / (4 pi r^2) where turns lie on one another, r the radius at y = 0. Where the sensor
counts from another y, g is another.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array, Bools
from robocal.cables.material import BUILD_UP, GAIN

__all__ = ["DrumLaw", "reading", "slope"]

STEEP = 0.01  # tolerance: of the gain: a drum that winds up less with every turn than that is none


def slope(lengths: Array, gain: Array, build_up: Array) -> Array:
    """dl/dy of lengths l: g + 2 q y, the root of g^2 + 4 q l."""
    return np.sqrt(np.maximum(gain**2 + 4.0 * build_up * lengths, (STEEP * gain) ** 2))


def reading(lengths: Array, gain: Array, build_up: Array) -> Array:
    """The y that is shown of lengths l: that solution of l = g y + q y^2 which is l / g where q is nought."""
    return np.asarray(2.0 * lengths / (gain + slope(lengths, gain, build_up)))


class DrumLaw:
    """What a cable robot knows of the drums of its cables."""

    cables: tuple[str, ...]

    def values_of(self, symbols: Sequence[str], whose: Sequence[str]) -> Array:
        """Numbers (p, k) by symbol of cables or segments, not a number where one has none."""
        raise NotImplementedError

    @property
    def gain(self) -> Array:
        """Length that each drum winds up over the length that its sensor shows, (m,); 1 where nobody states one."""
        found = self.values_of((GAIN,), self.cables)[:, 0]
        return np.where(np.isnan(found), 1.0, found)

    @property
    def build_up(self) -> Array:
        """By how much its gain grows per length that the sensor shows, half of it, (m,) in 1/m; 0 where nobody states it."""
        return np.nan_to_num(self.values_of((BUILD_UP,), self.cables)[:, 0])

    @property
    def states_gains(self) -> bool:
        """Whether the gains of its drums are parameters of it."""
        return not bool(np.isnan(self.values_of((GAIN,), self.cables)).all())

    @property
    def states_build_up(self) -> bool:
        """Whether its drums grow with every turn."""
        return not bool(np.isnan(self.values_of((BUILD_UP,), self.cables)).all())

    def readings(self, lengths: Array) -> Array:
        """What the sensors show of lengths (k, m) less their zeros."""
        return reading(lengths, self.gain, self.build_up)

    def wound(self, read: Array) -> Array:
        """The lengths (k, m) less their zeros of which sensors show (k, m)."""
        return np.asarray(read * (self.gain + self.build_up * read))

    def unwinds(self, read: Array) -> Bools:
        """Where sensors that show (k, m) are beyond what a drum of negative build-up can wind up at all, (k, m)."""
        return np.asarray(self.winding(read) < STEEP * self.gain)

    def winding(self, read: Array) -> Array:
        """How fast lengths grow with what sensors show, (k, m), where these show (k, m)."""
        return np.asarray(self.gain + 2.0 * self.build_up * read)
