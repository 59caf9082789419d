"""The cable robot that a measurement of cables is of."""

from __future__ import annotations

from robocal.cables.geometry import CableRobot
from robocal.errors import ModelError
from robocal.measure.machine import Model

__all__ = ["cable_robot_of"]


def cable_robot_of(model: Model, what: str) -> CableRobot:
    """The cable robot of a machine. Raises ModelError where it has none; `what` was measured."""
    robot = model.part(CableRobot)
    if robot is None:
        raise ModelError(f"{what} need a cable robot", found=model.name, expected="kind: cable")
    return robot
