"""What pulls at a cable robot's platform and what its cables may bear, from its file and from options in its units."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from robocal.cables.geometry import CableRobot
from robocal.errors import FormatError, ModelError
from robocal.files.cable.robot import CableFile

__all__ = ["limited", "mass_of", "numbers_of", "wrench_of"]

Array = NDArray[np.float64]
UPRIGHT = {2, 3, 4}  # components of the twist (v, w) that a weight works on: z, and the turns about x and y


def limited(file: CableFile, limits: str | None = None) -> CableRobot:
    """The robot with tension limits: those of its file, or "LEAST,GREATEST" for every cable. Raises FormatError naming
    the key that is missing, ModelError for limits that make no sense."""
    robot = file.robot
    if limits is not None:
        low, high = (file.units.force.to_si(v) for v in numbers_of(limits, "--limits", ("LEAST", "GREATEST")))
        if not 0 <= low < high:
            raise ModelError(
                "the tension limits are crossed or negative",
                key="--limits",
                found=limits,
                expected="0 <= LEAST < GREATEST",
            )
        return replace(robot, limits=np.tile([low, high], (len(robot.cables), 1)))
    if robot.limits is None:
        raise FormatError(
            f"the tension limits of {robot.name} are not known",
            file=file.path,
            key="every_cable.tension",
            expected="every_cable: {tension: [LEAST, GREATEST]}, or --limits LEAST,GREATEST",
        )
    return robot


def mass_of(file: CableFile, payload: float = 0.0, mass: float | None = None) -> float:
    """Mass of the platform (its file's, or `mass`) with a payload, both in the file's unit of mass, in kg; zero where it is
    not known and does not matter: a planar robot that lies. Raises FormatError where it matters, ModelError for a mass
    that cannot be."""
    robot = file.robot
    for option, value in (("--payload", payload), ("--mass", mass)):
        if value is not None and not (math.isfinite(value) and value >= 0):
            raise ModelError("a mass is a number", key=option, found=value, expected="0 or more")
    more = float(file.units.mass.to_si(payload))
    if mass is not None:
        return float(file.units.mass.to_si(mass)) + more
    if robot.mass is None and UPRIGHT.intersection(robot.axes):
        raise FormatError(
            f"the mass of {robot.name} is not known",
            file=file.path,
            key="platform.mass",
            expected="platform: {mass: ...}, or --mass",
        )
    return (robot.mass or 0.0) + more


def wrench_of(file: CableFile, wrench: str | None) -> Array:
    """ "FX,FY,FZ,MX,MY,MZ" (forces in the file's unit, moments in Nm, base axes) as (6,) in N and N m; zero for None.
    Raises ModelError."""
    if wrench is None:
        return np.zeros(6)
    values = np.array(numbers_of(wrench, "--wrench", ("FX", "FY", "FZ", "MX", "MY", "MZ")))
    values[:3] = file.units.force.to_si(values[:3])
    return values


def numbers_of(text: str, option: str, names: tuple[str, ...]) -> list[float]:
    """As many finite numbers as names, between commas. Raises ModelError."""
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        values = []
    if len(values) != len(names) or not all(math.isfinite(v) for v in values):
        raise ModelError("not what this option takes", key=option, found=text, expected=",".join(names))
    return values
