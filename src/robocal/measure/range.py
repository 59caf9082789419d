"""Range by time of flight: r = |p_target - p_place| c0 / c + delay - y.

value y (k, 1) in m is the apparent range: time of flight times the nominal speed c0. Ultrasonic receivers, radio or
draw-wire sensors at fixed places. `options["place"]` is the receiver as a frame on the base (its x y z are seen), one
set of observations for each; `options["medium"]` names what they share: the parameters `NAME.speed` c (m/s) and
`NAME.delay` (m). `options["speed"]` is c0, 343 m/s by default and the start of c. Four receivers that are not in one
plane are enough; a delay that is free needs targets at clearly different ranges, a speed that is free needs known link
lengths.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array, Ints
from robocal.errors import ModelError
from robocal.measure.builder import Builder
from robocal.measure.data import Observations
from robocal.measure.rows import Between, Kind, Number, Rows, number_names, numbers, place_of, places_of, register
from robocal.parameters import Parameter

__all__ = ["RANGE", "nominal_speed"]

UNSTATED = (1e-3,)
SOUND = 343.0  # m/s, in dry air at 20 C


def nominal_speed(obs: Observations) -> float:
    """c0 in m/s. Raises ModelError when it is not above 0."""
    speed = obs.options.get("speed", SOUND)
    if not isinstance(speed, int | float) or not speed > 0:
        raise ModelError("a speed must be above 0", key=f"{obs.label}.speed", found=speed, expected="m/s")
    return float(speed)


def medium_numbers(obs: Observations) -> tuple[Number, Number]:
    """Speed and delay; five degrees of air temperature are 3 m/s, a delay of 10 us is 3 mm."""
    speed = nominal_speed(obs)
    return Number("medium", "speed", "m/s", speed, 0.01 * speed), Number("medium", "delay", "m", 0.0, 0.01)


class RangeRows(Between):
    """The distance stretched by the speed, plus the delay."""

    def __init__(self, builder: Builder, obs: Observations, target: int, index: Ints) -> None:
        own = builder.rows(number_names(obs, medium_numbers(obs)))
        super().__init__(builder.between(place_of(obs), obs, target, index), obs, index, UNSTATED, own)
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


def terms(builder: Builder, obs: Observations) -> list[Rows]:
    """One term per target."""
    return [RangeRows(builder, obs, t, index) for t, index in builder.split(obs)]


def parameters(obs: Observations) -> Sequence[Parameter]:
    """Speed and delay of the medium, where it has a name."""
    return numbers(obs, medium_numbers(obs))


RANGE = register(Kind("range", 1, terms, parameters, ((0, 1, "m"),), frames=places_of, metric=True, owner="medium"))
