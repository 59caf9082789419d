"""What robot.yaml with `kind: cable` may say: its keys. Values are read by `values.py`."""

from __future__ import annotations

from typing import Any, Literal

from robocal.files.schema import FileModel, Name, Version

__all__ = ["CableModel", "CableRobotModel", "CableUnitsModel", "CommonModel", "PlatformModel", "PulleyModel"]


class CableUnitsModel(FileModel):
    """units: {length, angle, force, mass}."""

    length: str
    angle: str = "deg"
    force: str = "N"
    mass: str = "kg"


class PulleyModel(FileModel):
    """A pulley: radius, and the direction in which the cable enters it."""

    radius: Any
    axis: Any


class CommonModel(FileModel):
    """What is known of a cable, or under `every_cable` of all."""

    tension: Any = None
    elasticity: Any = None
    density: Any = None
    diameter: Any = None
    pulley: PulleyModel | None = None


class CableModel(CommonModel):
    """One cable: its two anchors by name (or number from 1) and the zero of its length sensor."""

    name: Name | None = None
    frame: Any = None
    platform: Any = None
    zero: Any = None


class PlatformModel(FileModel):
    """The platform as a body."""

    mass: Any = None
    centre_of_mass: Any = None
    inertia: Any = None


class CableCalibrateModel(FileModel):
    """What is to be identified: ax ay az bx by bz l0, a cable, or single names."""

    free: list[str]


class CableRobotModel(FileModel):
    """robot.yaml with `kind: cable` as a mapping."""

    robocal: Version
    name: str
    kind: Literal["cable"]
    units: CableUnitsModel
    degrees: Literal["2T", "1R2T", "3T", "3R3T"] = "3R3T"
    plane: Literal["xy", "xz", "yz"] = "xz"
    frame_anchors: Any
    platform_anchors: Any
    cables: list[CableModel] | None = None
    every_cable: CommonModel | None = None
    platform: PlatformModel | None = None
    calibrate: CableCalibrateModel | None = None
    source: str | None = None
