"""The cables of a robot as kernels of one pose at a time read them: one row for each segment."""

from __future__ import annotations

import numpy as np

from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.cables.pulley import Pulleys

__all__ = ["cable_table"]


def cable_table(robot: CableRobot) -> Array:
    """The segments as kernels read them, (p, 14), those of each cable's own before all others: a, b, l0, the radius of the pulley and its
    axis; the number of the cable, how often it runs along the segment, and 1 where this is on one body."""
    ways = robot.segments
    wheel = robot.wheels or Pulleys(np.zeros(len(ways.names)), np.tile([0.0, 0.0, 1.0], (len(ways.names), 1)))
    return np.column_stack([robot.ends, wheel.radius, wheel.axis, ways.cable, ways.times, ways.still])
