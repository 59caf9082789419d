"""What stands between a controller and winches: an interface, of which the project has the simulator alone.

    state = drive(controller, state, driver, goal, seconds)

Nothing here opens a port. docs/cables/control.md says what a driver of real winches has to guarantee.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

from numpy.typing import ArrayLike

from robocal._jit import as_kernel_array
from robocal._types import Array
from robocal.control.platform.platform_controller import Command, PlatformController, PlatformState
from robocal.errors import require

__all__ = ["Driver", "WinchReading", "drive"]


class WinchReading(NamedTuple):
    """Angles (m,) of the motors in rad, all of one moment, and tensions (m,) in N where there are sensors."""

    angles: Array
    tension: Array | None = None


class Driver(Protocol):
    """Winches: `read` waits for the next period and says what they show, `write` gives them torques and brakes."""

    def read(self) -> WinchReading:
        """The readings of the next period."""
        ...

    def write(self, command: Command) -> None:
        """Torques (m,) in N m that wind cable in, and whether brakes close."""
        ...


def drive(
    controller: PlatformController, state: PlatformState, driver: Driver, goal: ArrayLike, seconds: float
) -> PlatformState:
    """The state after so many seconds towards a goal (4, 4), or when brakes close. Raises ModelError for no such time, and for arrays
    of another shape."""
    require(0 <= seconds < math.inf, "no such time", key="seconds", found=seconds, expected="0 s or more")
    target = as_kernel_array(goal)
    for _ in range(round(seconds / controller.period)):
        reading = driver.read()
        state, command = controller.step(state, target, reading.angles, reading.tension)
        driver.write(command)
        if command.brake:
            break
    return state
