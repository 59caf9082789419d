"""A robot as pictures show it: every segment along which a cable runs between frame and platform as a line of its own."""

from __future__ import annotations

import numpy as np

from robocal._record import replace
from robocal._types import Ints
from robocal.cables.geometry import CableRobot, cable_robot
from robocal.cables.pulley import Pulleys

__all__ = ["of_segments", "segment_robot"]


def of_segments(robot: CableRobot) -> Ints:
    """The numbers (n,) of the segments that are drawn."""
    return np.flatnonzero(~robot.segments.still)


def segment_robot(robot: CableRobot) -> CableRobot:
    """The robot with a cable for each of these, called by its cable and its own name; itself where every cable is straight."""
    ways = robot.segments
    if ways.is_plain:
        return robot
    shown = of_segments(robot)
    cable, wheels = ways.cable[shown], robot.wheels
    alone = np.bincount(cable, minlength=len(robot.cables)) == 1
    names = [
        robot.cables[c] if alone[c] else f"{robot.cables[c]} {ways.labels[s]}"
        for s, c in zip(shown, cable, strict=True)
    ]
    known = {w: None if (v := getattr(robot, w)) is None else v[cable] for w in ("limits", "density", "diameter")}
    ends = robot.ends[shown]
    bare = cable_robot(
        robot.name, ends[:, :3], ends[:, 3:6], names=names, degrees=robot.degrees, plane=robot.plane, mass=robot.mass, com=robot.com,
        pulleys=None if wheels is None else Pulleys(wheels.radius[shown], wheels.axis[shown]),
    )  # fmt: skip
    return replace(bare, **known)  # type: ignore[arg-type]
