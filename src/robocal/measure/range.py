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
from dataclasses import replace

import numpy as np

from robocal._types import Array, Ints
from robocal.errors import ModelError
from robocal.measure.builder import Builder, places_of
from robocal.measure.data import Observations
from robocal.measure.rows import METRES, Between, Carriers, Kind, Number, numbers, per_target, register
from robocal.parameters import Parameter

__all__ = ["RANGE", "nominal_speed"]

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
