"""The measurement kinds that exist: one line each, with the module of this package that is loaded when the kind is met."""

from __future__ import annotations

__all__ = ["MODULES", "NAMES"]

MODULES = {
    "position": "pose",
    "pose": "pose",
    "spherical": "angular",
    "bearing": "angular",
    "range": "distance",
    "distance": "distance",
    "displacement": "pose",
    "relative_pose": "pose",
    "point": "contact",
    "plane": "contact",
    "sphere": "contact",
    "pixels": "pixels",
    "inclination": "angular",
    "lengths": "lengths",
    "load": "load",
    "swivel": "swivel",
}
NAMES = tuple(sorted(MODULES))
