"""Distance between two points: r = |p_b - p_a| - (d + length).

value d (k, 1) in m. The two points are `options["ends"]`, two frames mounted on "base" or "tool": two sockets a known
distance apart, a ballbar from a socket on the base to a ball on the tool. Where `second` names another configuration,
end b is taken there; without ends both points are the observed target (a telescopic bar between two configurations).
`options["length"]` names a bar whose parameter `NAME.length` (m) adds to the reading: unknown when it is free, so that
a fixed bar of unknown length reads 0. A bar of unknown length in one socket cannot see the scale of the arm.
Source: Goswami, Quaid and Peshkin, Identifying robot parameters using partial pose information (1993).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array, Ints
from robocal.errors import ModelError
from robocal.measure.builder import Builder
from robocal.measure.carriers import Carrier
from robocal.measure.data import Frame, Observations
from robocal.measure.rows import METRES, Between, Kind, Number, per_target, register

__all__ = ["DISTANCE"]


class DistanceRows(Between):
    """|p_b - p_a| minus the reading and the bar's own length."""

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        length, j, jl = self.length(x, first, rows)
        length = length - self.values_at(which, first, rows) - x[:, self.numbers].sum(axis=1)[:, None, None]
        own = np.full((*j.shape[:3], len(self.own)), -1.0)
        return length, np.concatenate([j, own], axis=3), jl


def ends(obs: Observations) -> Sequence[Frame]:
    """The two frames; none where the ends are one target at two configurations. Raises ModelError otherwise."""
    found = obs.options.get("ends", ())
    if not isinstance(found, tuple) or len(found) != (0 if obs.second is not None and not found else 2):
        raise ModelError("a distance needs two ends", found=found, expected="two frames")
    return found


def pair(builder: Builder, obs: Observations, target: int, index: Ints) -> tuple[Carrier, Carrier]:
    """The two points, the second at the other configuration where there is one."""
    first = obs.configuration[index]
    other = first if obs.second is None else builder.second(obs, index)
    if found := ends(obs):
        return builder.carrier_of(found[0], first), builder.carrier_of(found[1], other)
    return builder.target(obs, target, first, index), builder.target(obs, target, other, index)


NUMBERS = (Number("length", "length", expected=0.1),)
ROWS = per_target(DistanceRows, pair)
DISTANCE = register(Kind("distance", 1, ROWS, parts=METRES, frames=ends, owner="length", numbers=NUMBERS))
