"""The one driver there is: winches that are simulated."""

from __future__ import annotations

from robocal.control.driver import WinchReading
from robocal.control.platform.platform_controller import Command
from robocal.simulation.platform.rig_run import Wiring
from robocal.simulation.platform.winch_plant import Driven, WinchPlant

__all__ = ["SimulatedDriver"]


class SimulatedDriver:
    """A plant in place of winches: `write` lets it move for one period (s), unless brakes close; `driven` is where it is."""

    def __init__(self, plant: WinchPlant, driven: Driven, wiring: Wiring | None = None, period: float = 1e-3) -> None:
        self.plant, self.driven, self.period = plant, driven, period
        self.wiring = wiring or Wiring()

    def read(self) -> WinchReading:
        """What encoders and sensors show now."""
        return WinchReading(self.wiring.readings(self.driven), self.wiring.sensed(self.driven))

    def write(self, command: Command) -> None:
        """Torques of one period, or brakes."""
        if not command.brake:
            torque = self.wiring.torque(command.torque)
            self.driven = self.plant.run(self.driven, torque, self.period, self.period)
