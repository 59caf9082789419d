"""The measurement kinds that exist: one import line each."""

from robocal.measure import (
    bearing,
    displacement,
    distance,
    lengths,
    pixels,
    plane,
    point,
    pose,
    position,
    range,
    relative_pose,
    sphere,
    spherical,
)

__all__ = [
    "bearing",
    "displacement",
    "distance",
    "lengths",
    "pixels",
    "plane",
    "point",
    "pose",
    "position",
    "range",
    "relative_pose",
    "sphere",
    "spherical",
]
