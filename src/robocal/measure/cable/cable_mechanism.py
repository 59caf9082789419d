"""The cable robot that a measurement of cables is of, and what the rows of all its cables share."""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Ints
from robocal.cables.geometry import CableRobot
from robocal.errors import ModelError
from robocal.measure.builder import Builder
from robocal.measure.data import Observations
from robocal.measure.machine import Model
from robocal.measure.rows import Rows

__all__ = ["ENDS", "PlatformRows", "cable_robot_of"]

ENDS = ("ax", "ay", "az", "bx", "by", "bz")


def cable_robot_of(model: Model, what: str) -> CableRobot:
    """The cable robot of a machine. Raises ModelError where it has none; `what` was measured."""
    robot = model.part(CableRobot)
    if robot is None:
        raise ModelError(f"{what} need a cable robot", found=model.name, expected="kind: cable")
    return robot


class PlatformRows(Rows):
    """Rows of many cables at each configuration, which all look at the platform's one pose there."""

    sight: Ints

    def __init__(self, builder: Builder, obs: Observations, index: Ints, numbers: Ints) -> None:
        configurations, sight = np.unique(obs.configuration[index], return_inverse=True)
        super().__init__(builder.tool(configurations), obs, index, numbers, np.ascontiguousarray(sight.ravel()))

    def look(self, x: Array, first: int, rows: int) -> tuple[tuple[Array, Array, Array], Ints, int]:
        """The poses that some rows look at, with their Jacobians; which of them each row does, and the number of the first."""
        own = self.sight[first : first + rows]
        lo, hi = (int(own.min()), int(own.max()) + 1) if rows else (0, 0)
        return self.carrier.pose(x, lo, hi - lo), own - lo, lo
