"""P and PID controllers as pure steps: `step(law, state, error) -> (state, output)`.

    u = kp e + I + kd de/dt        I grows by ki e T in every period T; |u| <= limit

The rate of the error passes a first-order filter, where a filter time is given. Anti-windup: while u is at its limit and e would push it
further, I stays as it is. A proportional controller is the same law with ki = kd = 0. The error may be one of position or of speed: the law
does not know. Source: seed document, 1.3, 1.4.3, 2.4.3 and 3.6.3.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.control._kernels import pid_step
from robocal.errors import look_up, require

__all__ = ["GAINS", "ControlLaw", "ControllerState", "step"]

# The controllers by name, and the gains that each needs.
GAINS: Mapping[str, tuple[str, ...]] = MappingProxyType({"p": ("kp",), "pid": ("kp", "ki", "kd")})


@record
class ControllerState:
    """What a controller remembers from one period to the next: its integral, and the last error with its filtered rate."""

    integral: float = 0.0
    error: float = 0.0
    rate: float = 0.0


@record
class ControlLaw:
    """Gains of a controller, its period and filter time (s), and the largest output. Raises ModelError for what is no gain."""

    kp: float
    ki: float = 0.0
    kd: float = 0.0
    period: float = 1e-3
    filter_time: float = 0.0
    limit: float = math.inf

    def __post_init__(self) -> None:
        for key in ("kp", "ki", "kd", "filter_time"):
            value = getattr(self, key)
            require(0 <= value < math.inf, "not a gain", key=key, found=value, expected="0 or more")
        for key in ("period", "limit"):
            value = getattr(self, key)
            good = value > 0 and (key == "limit" or value < math.inf)
            require(good, "not above zero", key=key, found=value, expected="above 0")

    @classmethod
    def of(cls, name: str, **numbers: float) -> ControlLaw:
        """The law of a name of GAINS, from its gains and whatever else a law has: `ControlLaw.of("p", kp=0.05, limit=0.2)`. Raises
        ModelError for an unknown name, for a gain that it needs and one that it has not."""
        own = look_up(GAINS, name, "unknown controller", "controller")
        every = {gain for gains in GAINS.values() for gain in gains}
        for gain in sorted(every):
            known, expected = (gain in numbers) == (gain in own), " ".join(own)
            require(
                known, f"the gains of {name} are others", key=gain, found=" ".join(sorted(numbers)), expected=expected
            )
        return cls(**numbers)

    @property
    def array(self) -> Array:
        """kp, ki, kd, filter time, limit and period, for a compiled loop."""
        return np.array([self.kp, self.ki, self.kd, self.filter_time, self.limit, self.period])


def step(law: ControlLaw, state: ControllerState, error: float) -> tuple[ControllerState, float]:
    """The state one period later, and the output."""
    numbers = (law.kp, law.ki, law.kd, law.filter_time, law.limit, law.period)
    integral, last, rate, output = pid_step(*numbers, state.integral, state.error, state.rate, float(error))
    return ControllerState(integral, last, rate), output
