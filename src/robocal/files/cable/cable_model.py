"""What robot.yaml with `kind: cable` may say: its keys, and its values.

A value is a plain number or list, or `{value, unit, source, assumed}` where one of these is to be said of it alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, FiniteFloat

from robocal._record import record
from robocal._types import Array
from robocal.errors import one_of
from robocal.files.schema import FileModel, Name, Version
from robocal.files.units import UNITS, Unit, Units
from robocal.files.yamlio import Path_, YamlDocument, path_text

__all__ = [
    "MATERIALS",
    "CableCalibrateModel",
    "CableModel",
    "CableRobotModel",
    "CableSegmentModel",
    "CableUnits",
    "CableValues",
    "CommonModel",
    "PulleyModel",
    "RailModel",
]  # fmt: skip


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

    def numbers(self, at: Path_, values: CableValues) -> tuple[float, Array]:
        """Radius in m, and axis (3,). Raises FormatError."""
        axis = values.vector(self.axis, (*at, "axis"), "1")
        if not axis.any():
            values.document.fail("an axis needs a direction", (*at, "axis"), found=self.axis, expected="not all zero")
        return values.number(self.radius, (*at, "radius"), "m"), axis


class CommonModel(FileModel):
    """What is known of a cable, or under `every_cable` of all."""

    tension: Any = None
    elasticity: Any = None
    density: Any = None
    diameter: Any = None
    gain: Any = None
    build_up: Any = None
    pulley: PulleyModel | None = None


class RailModel(FileModel):
    """A rail on which a frame anchor stands: direction, where its carriage stands, and how much further it goes than it reads."""

    direction: Any
    carriage: Any
    gain: Any = None


class CableSegmentModel(FileModel):
    """A straight piece of cable between two anchors, one of the frame and one of the platform, or two of either."""

    frame: Any = None
    platform: Any = None
    pulley: PulleyModel | None = None
    rail: RailModel | None = None


class CableModel(CommonModel):
    """One cable: its two anchors by name (or number from 1) and the zero of its length sensor; or the segments that it runs along, a
    whole number of times each."""

    name: Name | None = None
    frame: Any = None
    platform: Any = None
    zero: Any = None
    rail: RailModel | None = None
    segments: dict[Name, Any] | None = None


class PlatformModel(FileModel):
    """The platform as a body."""

    mass: Any = None
    centre_of_mass: Any = None
    inertia: Any = None


class CableCalibrateModel(FileModel):
    """What is to be identified: ax ay az bx by bz l0 gain, a cable, or single names; and how far off what is stated may be, one standard
    deviation by symbol or single name. `correlation` is of priors that are all single names, in their order."""

    free: list[str]
    prior: dict[str, Any] = Field(default_factory=dict)
    correlation: list[list[FiniteFloat]] | None = None


OrEmpty = BeforeValidator(lambda value: {} if value is None else value)


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
    segments: dict[Name, CableSegmentModel] | None = None
    cables: list[CableModel] | None = None
    every_cable: Annotated[CommonModel, OrEmpty] = CommonModel.model_construct()
    platform: Annotated[PlatformModel, OrEmpty] = PlatformModel.model_construct()
    calibrate: CableCalibrateModel | None = None
    source: str | None = None


KEYS = ("value", "unit", "source", "assumed")
# What a cable is made of: its key in robot.yaml -> the field of CableRobot, and its unit in SI.
MATERIALS = {
    "tension": ("limits", "N"),
    "elasticity": ("elasticity", "1/N"),
    "build_up": ("build_up", "1/m"),
    "density": ("density", "N/m"),
    "diameter": ("diameter", "m"),
    "gain": ("gain", "1"),
}


@record
class CableUnits:
    """The units in which a file speaks; what is made of several follows from them."""

    length: Unit = UNITS["m"]
    angle: Unit = UNITS["deg"]
    force: Unit = UNITS["N"]
    mass: Unit = UNITS["kg"]

    def of(self, si: str) -> Unit:
        """The unit for a quantity whose SI unit is `si`."""
        length, force, mass = self.length, self.force, self.mass
        made = {
            "m": length,
            "rad": self.angle,
            "N": force,
            "kg": mass,
            "1/m": Unit(f"1/{length.name}", si, 1 / length.factor),
            "1/N": Unit(f"1/{force.name}", si, 1 / force.factor),
            "N/m": Unit(f"{force.name}/{length.name}", si, force.factor / length.factor),
            "kg m2": Unit(f"{mass.name} {length.name}2", si, mass.factor * length.factor**2),
        }
        return made.get(si) or Units(length, self.angle).of(si or "1")


@dataclass
class CableValues:
    """Reads values at key paths into SI and notes which were said to come from somewhere, or to be assumed."""

    document: YamlDocument
    units: CableUnits
    sources: dict[str, str] = field(default_factory=dict)
    assumed: list[str] = field(default_factory=list)

    def number(self, raw: Any, at: Path_, si: str) -> float:
        """One number. Raises FormatError."""
        value, unit, path = self._open(raw, at, si)
        return self._one(value, path, unit)

    def vector(self, raw: Any, at: Path_, si: str, size: int = 3) -> Array:
        """A list of `size` numbers. Raises FormatError."""
        value, unit, path = self._open(raw, at, si)
        return np.array(self._list(value, path, unit, size))

    def matrix(self, raw: Any, at: Path_, si: str) -> Array:
        """Three lists of three numbers. Raises FormatError."""
        value, unit, path = self._open(raw, at, si)
        if not isinstance(value, list) or len(value) != 3:
            self.document.fail("wrong shape", path, found=value, expected="three lists of three numbers")
        return np.array([self._list(row, (*path, i), unit, 3) for i, row in enumerate(value)])

    def place(self, raw: Any, at: Path_, si: str) -> tuple[Path_, Unit]:
        """Where a value stands, and its unit: what writing back needs."""
        _, unit, path = self._open(raw, at, si)
        return path, unit

    def _open(self, raw: Any, at: Path_, si: str) -> tuple[Any, Unit, Path_]:
        unit = self.units.of(si)
        if not isinstance(raw, dict):
            return raw, unit, at
        for key in raw:
            if key not in KEYS:
                self.document.fail("unknown key", (*at, key), **one_of(key, KEYS))
        if "value" not in raw:
            self.document.fail("a key is missing", (*at, "value"), expected="{value: ..., source: ..., assumed: true}")
        if raw.get("unit") is not None:
            where = (*at, "unit")
            unit = self.document.unit(raw["unit"], si, where)
        if not isinstance(raw.get("source", ""), str):
            self.document.fail("not a text", (*at, "source"), found=raw["source"], expected="a text")
        if not isinstance(raw.get("assumed", False), bool):
            self.document.fail("not true or false", (*at, "assumed"), found=raw["assumed"], expected="true or false")
        name = path_text(at)
        if raw.get("source"):
            self.sources[name] = raw["source"]
        if raw.get("assumed") and name not in self.assumed:
            self.assumed.append(name)
        return raw["value"], unit, (*at, "value")

    def _list(self, value: Any, at: Path_, unit: Unit, size: int) -> list[float]:
        if not isinstance(value, list) or len(value) != size:
            self.document.fail("wrong shape", at, found=value, expected=f"a list of {size} numbers")
        return [self._one(v, (*at, i), unit) for i, v in enumerate(value)]

    def _one(self, value: Any, at: Path_, unit: Unit) -> float:
        bad = isinstance(value, bool) or not isinstance(value, int | float)
        if bad or not math.isfinite(value):
            expected = "a finite number" + ("" if unit.name == "1" else f" in {unit.name}")
            self.document.fail("not a finite number", at, found=value, expected=expected)
        return unit.to_si(float(value))
