"""Kinds that read how far two points are apart: a distance, a range by time of flight.

Distance between two points: r = |p_b - p_a| - (d + length).

value d (k, 1) in m. The two points are `options["ends"]`, two frames mounted on "base" or "tool": two sockets a known
distance apart, a ballbar from a socket on the base to a ball on the tool. Where `second` names another configuration,
end b is taken there; without ends both points are the observed target (a telescopic bar between two configurations).
`options["length"]` names a bar whose parameter `NAME.length` (m) adds to the reading: unknown when it is free, so that
a fixed bar of unknown length reads 0. A bar of unknown length in one socket cannot see the scale of the arm.
Source: Goswami, Quaid and Peshkin, Identifying robot parameters using partial pose information (1993).

Range by time of flight: r = |p_target - p_place| c0 / c + delay - y.

value y (k, 1) in m is the apparent range: time of flight times the nominal speed c0. Ultrasonic receivers, radio or
draw-wire sensors at fixed places. `options["place"]` is the receiver as a frame on the base (its x y z are seen), one
set of observations for each; `options["medium"]` names what they share: the parameters `NAME.speed` c (m/s) and
`NAME.delay` (m). `options["speed"]` is c0, 343 m/s by default and the start of c. Four receivers that are not in one
plane are enough; a delay that is free needs targets at clearly different ranges, a speed that is free needs known link
lengths.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from robocal._types import Array, Ints
from robocal.errors import ModelError
from robocal.measure.builder import Builder, places_of
from robocal.measure.carriers import Carrier
from robocal.measure.data import Frame, Observations
from robocal.measure.rows import METRES, Between, Carriers, Kind, Number, numbers, per_target, register
from robocal.parameters import Parameter

__all__ = ["DISTANCE", "RANGE", "nominal_speed"]

# --- distance ---------------------------------------------------------------------------------------------------------


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


# --- range ------------------------------------------------------------------------------------------------------------

SOUND = 343.0  # m/s, in dry air at 20 C
# Five degrees of air temperature are 3 m/s, a delay of 10 us is 3 mm.
SPEED, DELAY = Number("medium", "speed", "m/s"), Number("medium", "delay", expected=0.01)


def nominal_speed(obs: Observations) -> float:
    """c0 in m/s. Raises ModelError when it is not above 0."""
    speed = obs.options.get("speed", SOUND)
    if not isinstance(speed, int | float) or not speed > 0:
        raise ModelError("a speed must be above 0", key=f"{obs.label}.speed", found=speed, expected="m/s")
    return float(speed)


def parameters(obs: Observations) -> Sequence[Parameter]:
    """Speed and delay of the medium, where it has a name."""
    speed = nominal_speed(obs)
    return numbers(obs, [replace(SPEED, value=speed, expected=0.01 * speed), DELAY])


class RangeRows(Between):
    """The distance stretched by the speed, plus the delay."""

    def __init__(self, carrier: Carriers, obs: Observations, index: Ints, numbers: Ints) -> None:
        super().__init__(carrier, obs, index, numbers)
        self.speed = nominal_speed(obs)
        # Through a medium times are measured: its speed says how long they are, as a stated length does.
        self.metric = not len(self.numbers)

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        length, j, jl = self.length(x, first, rows)
        if not len(self.numbers):
            return length - self.values_at(which, first, rows), j, jl
        speed, delay = x[:, self.numbers, None, None].swapaxes(0, 1)
        stretch = self.speed / speed
        by_number = np.stack([-length * stretch / speed, np.ones_like(length)], axis=3)
        jac = np.concatenate([stretch[..., None] * j, by_number[..., self.own]], axis=3)
        return stretch * length + delay - self.values_at(which, first, rows), jac, stretch[..., None] * jl


ROWS = per_target(RangeRows, Builder.between)
RANGE = register(
    Kind(
        "range", 1, ROWS, parameters, METRES, frames=places_of, metric=True, owner="medium", numbers=(SPEED, DELAY), unstated=1e-3
    )
)  # fmt: skip
