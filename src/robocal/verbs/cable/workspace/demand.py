"""What a cable robot is to hold wherever it goes: a `Demand` from options in its file's units."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.cables.workspace import Demand
from robocal.errors import ModelError
from robocal.files.cable.cablefile import CableFile
from robocal.files.units import numbers_of
from robocal.geometry import so3
from robocal.session.cable.statics_options import mass_of, wrench_of

__all__ = ["demand_of"]

AROUND = 8  # directions in which a platform is tilted, by half the angle and by all of it
TURNS = ("RX", "RY", "RZ")


def demand_of(file: CableFile, said: Any, si: Any) -> Demand:
    """Everything that is asked for, in SI, from the options of the verb as they were said and in SI. Raises FormatError naming the
    file where the mass is missing, ModelError naming an option that makes no sense.

    payload and mass are a range or one number: mass stands for the platform's own, payload hangs at its centre of mass; wrench
    as for `wrench_of`, every one of them. With closure none of them is asked for.
    """
    turns = _orientations(file.robot, said, si)
    if said.closure:
        for name in ("mass", "payload", "wrench", "acceleration", "reserve", "limits"):
            if getattr(said, name):
                raise ModelError(
                    "with wrench closure, tensions have any size and hold any wrench, so this option has no effect",
                    key=f"--{name}", found=getattr(said, name), expected="--closure alone, or without it",
                )  # fmt: skip
        return Demand(np.zeros(1), turns, length=si.length or 1.0, closure=True)
    masses = _range(said.mass, "--mass", file) if said.mass is not None else (mass_of(file),)
    masses = tuple(
        sorted({m + more for m, more in zip(*_pair_ends(masses, _range(said.payload, "--payload", file)), strict=True)})
    )
    extra = np.array([wrench_of(file, text) for text in said.wrench]) if said.wrench else np.zeros((1, 6))
    return Demand(np.array(masses), turns, extra, si.acceleration, si.reserve, si.length or 1.0)


def _range(text: str | None, option: str, file: CableFile) -> tuple[float, ...]:
    """One mass or the ends of a range, in kg; nothing is no mass at all."""
    if text is None:
        return (0.0,)
    values = numbers_of(text, "LO,HI" if "," in text else "MASS", key=option)
    if values[0] < 0 or values[-1] < values[0]:
        raise ModelError("a mass is 0 or more, a range rises", key=option, found=text, expected="0 <= LO <= HI")
    return tuple(float(file.units.mass.to_si(v)) for v in values)


def _pair_ends(a: tuple[float, ...], b: tuple[float, ...]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Two ranges as two lists of ends: least with least, greatest with greatest."""
    return (a[0], a[-1]), (b[0], b[-1])


def _orientations(robot: CableRobot, said: Any, si: Any) -> Array:
    """Rotations (n, 3, 3): each of those given, and where tilts are asked for, tilted to all sides about horizontal axes."""
    vectors = np.array(si.orientation or [np.zeros(3)])
    lost = [i for i in range(3) if i + 3 not in robot.axes]
    if vectors[:, lost].any():
        raise ModelError(
            f"{robot.name} does not turn that way",
            key="--orientation",
            found=said.orientation[int(np.argmax(vectors[:, lost].any(axis=1)))],
            expected=f"0 for {', '.join(TURNS[i] for i in lost)}: it is {_moves(robot)}",
        )
    upright = so3.exp(vectors)
    if si.tilt is None:
        return upright
    if not 0 < si.tilt < math.pi:
        raise ModelError("out of range", key="--tilt", found=said.tilt, expected="above 0 and below half a turn")
    leans = so3.exp(si.tilt * _sides(robot))
    turned: Array = (leans[:, None] @ upright).reshape(-1, 3, 3)
    return turned


def _moves(robot: CableRobot) -> str:
    return f"{robot.degrees} in {robot.plane}" if robot.planar else robot.degrees


def _sides(robot: CableRobot) -> Array:
    """Upright, and half and whole tilts about the horizontal axes that the robot has, (n, 3)."""
    if 4 not in robot.axes:
        raise ModelError("this robot cannot tilt", key="--tilt", found=_moves(robot))
    turn = 2 * np.pi * np.arange(AROUND) / AROUND if 3 in robot.axes else np.array([0.5, 1.5]) * np.pi
    ring = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=1)
    if 3 not in robot.axes:
        ring[:, 0] = 0.0
    return np.concatenate([np.zeros((1, 3)), 0.5 * ring, ring])
