"""A robot that is not quite its model, measured by an instrument that is not quite exact.

Everything that it writes says simulated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from robocal.arms.chain import Chain
from robocal.errors import ModelError, nearest
from robocal.files.datawrite import data_text, table_text
from robocal.files.robot import Robot, describe, parse_robot, render_robot
from robocal.files.text import Source
from robocal.files.units import numbers_of
from robocal.measure.data import DataSet
from robocal.planning.candidates import joint_range
from robocal.session.inputs import open_arm
from robocal.simulation.hiding import hidden
from robocal.simulation.rigs import FINE, STANDS, Instrument, measure

__all__ = [
    "Errors",
    "Instrument",
    "Simulated",
    "errors_of",
    "instrument_of",
    "measure",
    "parse_frame",
    "sample_joints",
    "simulated_files",
    "true_chain",
    "written_whole",
]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Errors:
    """How the true robot differs: normal errors of lengths and angles of its geometry, and values set by name (all
    SI)."""

    length: float = 3e-4
    angle: float = 1e-3
    values: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class Simulated:
    """The nominal and the true robot, the data in SI, and the files that were written."""

    robot: Robot
    truth: Chain
    data: DataSet
    errors: Errors
    instrument: Instrument
    seed: int
    largest_error: float
    written: tuple[Path, ...] = ()


def sample_joints(chain: Chain, count: int, rng: np.random.Generator) -> Array:
    """Joint values (count, n), uniform within the limits, or around zero where there are none."""
    low, high = joint_range(chain).T
    return np.asarray(rng.uniform(low, high, (count, len(low))))


def true_chain(chain: Chain, errors: Errors, rng: np.random.Generator) -> Chain:
    """The robot as it is said to be: perturbed geometry, then the values that were set. Raises ModelError for an
    unknown name."""
    size = {"m": errors.length, "rad": errors.angle}
    moved = {}
    for name in chain.geometric:
        step = rng.normal() * size.get(chain.table[name].unit, 0.0)
        moved[name] = chain.table[name].value + step
    return chain.with_values({**moved, **dict(errors.values)})


def simulated_files(robot: Robot, truth: Chain, data: DataSet, about: str) -> dict[str, str]:
    """The texts of a simulation: the nominal robot, the data with its frame unknown, and the truth."""
    values = {p.name: p.value for p in truth.table.rows}
    true_text, left_out = render_robot(robot, values)
    if left_out:
        raise ModelError(
            "this robot's format cannot hold these true values", found=", ".join(left_out), expected="a robot.yaml"
        )
    suffix = "urdf" if robot.format == "urdf" else "yaml"
    shown = hidden(data)
    label = f"# SIMULATED by robocal simulate, not measured: {about}\n"
    return {
        f"robot.{suffix}": robot.text,
        f"truth.{suffix}": true_text if suffix == "urdf" else label + true_text.partition("\n")[2],
        "data.csv": label + table_text(shown, robot.chain, robot.units),
        "data.yaml": label + data_text(shown, robot.chain, "data.csv", robot.units),
    }


def parse_frame(text: str, robot: Robot) -> tuple[float, ...] | None:
    """auto, none, or six numbers in the robot file's units. Raises ModelError."""
    if text in ("auto", "none"):
        return STANDS if text == "auto" else None
    x, y, z, *turn = numbers_of(text, "x,y,z,rx,ry,rz or none", key="--frame")
    return (*map(robot.units.length.to_si, (x, y, z)), *map(robot.units.angle.to_si, turn))


def written_whole(robot: str, base: str | None, tip: str | None) -> Robot:
    """The robot as opened; where its URDF cannot hold its own numbers, as of a run with a fitted tool, as robot.yaml."""
    arm = open_arm(robot, base=base, tip=tip)
    if not arm.left_out:
        return arm
    text = describe(arm.chain, arm.units)
    return parse_robot(Source(Path(f"{Path(robot).name or 'robot'}.yaml"), text, sha256(text.encode()).hexdigest()))


def instrument_of(arm: Robot, kind: str, noise: float | None, angle_noise: float | None, frame: str) -> Instrument:
    """The instrument in SI. Raises ModelError for a frame that is none."""
    usual = Instrument()
    return Instrument(
        kind,
        usual.noise if noise is None else noise,
        FINE.get(kind, usual.angle_noise) if angle_noise is None else angle_noise,
        parse_frame(frame, arm),
    )


def errors_of(arm: Robot, length: float | None, angle: float | None, settings: Sequence[str]) -> Errors:
    """How the true robot differs, in SI; settings in the robot file's units. Raises ModelError for unknown names."""
    usual, values = Errors(), tuple(_setting(text, arm) for text in settings)
    return Errors(usual.length if length is None else length, usual.angle if angle is None else angle, values)


def _setting(text: str, robot: Robot) -> tuple[str, float]:
    """NAME=VALUE in the robot file's units, to SI."""
    name, _, number = text.partition("=")
    try:
        value = float(number)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ModelError("not a setting", key="--set", found=text, expected="NAME=VALUE such as j2.r=1.5")
    if name.strip() not in robot.chain.table:
        known = robot.chain.table.names
        raise ModelError(
            "no parameter has this name", key="--set", found=name.strip(), suggestion=nearest(name.strip(), known)
        )
    return name.strip(), robot.unit_of(name.strip()).to_si(value)
