"""The verb `simulate`: a robot that is not quite its model, measured by an instrument that is not quite exact.

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
from robocal.errors import FileError, ModelError, nearest
from robocal.files.datawrite import data_text, table_text
from robocal.files.poses import read_poses
from robocal.files.robot import Robot, describe, parse_robot, render_robot
from robocal.files.text import Source
from robocal.files.writing import write_files
from robocal.jobs.inputs import Watch, open_arm
from robocal.measure.data import DataSet
from robocal.simulate.hiding import hidden
from robocal.simulate.rigs import CONTACTS, FINE, RIGS, STANDS, Instrument, measure

__all__ = [
    "Errors",
    "Instrument",
    "Simulated",
    "measure",
    "parse_frame",
    "refuse_existing",
    "sample_joints",
    "simulate",
    "simulated_files",
    "true_chain",
]

Array = NDArray[np.float64]
# Where nobody bounds a joint: a quarter turn, or a quarter of a metre, to either side.
WIDE = {"revolute": math.pi / 2, "prismatic": 0.25}


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
    wide = np.array([WIDE[j.type] for j in chain.joints])
    low, high = chain.limits.T
    low = np.where(np.isfinite(low), low, np.where(np.isfinite(high), high - 2 * wide, -wide))
    high = np.where(np.isfinite(high), high, low + 2 * wide)
    return np.asarray(rng.uniform(low, high, (count, len(wide))))


def true_chain(chain: Chain, errors: Errors, rng: np.random.Generator) -> Chain:
    """The robot as it is said to be: perturbed geometry, then the values that were set. Raises ModelError for an
    unknown name."""
    size = {"m": errors.length, "rad": errors.angle}
    moved = {}
    for name in chain.geometric:
        step = rng.normal() * size.get(chain.table[name].unit, 0.0)
        moved[name] = chain.table[name].value + step
    for name, value in errors.values:
        if name not in chain.table:
            raise ModelError(
                "no parameter has this name", key="--set", found=name, suggestion=nearest(name, chain.table.names)
            )
        moved[name] = value
    return chain.with_values(moved)


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


def refuse_existing(folder: Path, names: Sequence[str], force: bool) -> None:
    """Raises FileError when a file would be replaced and nobody said so."""
    for name in names:
        if (folder / name).exists() and not force:
            raise FileError(
                "this file exists and is left as it is",
                file=folder / name,
                expected="--force to replace it, or another place",
            )


def parse_frame(text: str, robot: Robot) -> tuple[float, ...] | None:
    """auto, none, or six numbers in the robot file's units. Raises ModelError."""
    if text in ("auto", "none"):
        return STANDS if text == "auto" else None
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != 6 or not all(math.isfinite(v) for v in numbers):
        raise ModelError("not a frame", key="--frame", found=text, expected="x,y,z,rx,ry,rz or none")
    length, angle = robot.units.length, robot.units.angle
    return tuple(length.to_si(v) if i < 3 else angle.to_si(v) for i, v in enumerate(numbers))


def simulate(
    robot: str,
    output: Path,
    *,
    poses: int = 80,
    at: str | None = None,
    kind: str = "position",
    noise: float | None = None,
    angle_noise: float | None = None,
    length_error: float | None = None,
    angle_error: float | None = None,
    settings: Sequence[str] = (),
    frame: str = "auto",
    seed: int = 0,
    force: bool = False,
    base: str | None = None,
    tip: str | None = None,
    watch: Watch | None = None,
) -> Simulated:
    """Simulates and writes robot, truth and data into a folder; numbers are in the robot file's units, and what is not
    given is as in `Errors` and `Instrument`. Raises InputError."""
    for option, value in (
        ("--noise", noise),
        ("--angle-noise", angle_noise),
        ("--length-error", length_error),
        ("--angle-error", angle_error),
    ):
        if value is not None and not 0 <= value < math.inf:
            raise ModelError(
                "not a standard deviation", key=option, found=value, expected="a finite number, 0 or larger"
            )
    if kind not in RIGS:
        raise ModelError(
            "unknown kind", key="--kind", found=kind, expected=", ".join(RIGS), suggestion=nearest(kind, RIGS)
        )
    if at is not None and kind in CONTACTS:
        raise ModelError("where the tool touches, the joint values follow", key="--at", found=at, expected="--poses")
    arm = open_arm(robot, base=base, tip=tip)
    if arm.left_out:
        # A URDF that cannot hold its own numbers, as of a run with a fitted tool: both files become robot.yaml.
        text = describe(arm.chain, arm.units)
        arm = parse_robot(Source(Path(f"{Path(robot).name or 'robot'}.yaml"), text, sha256(text.encode()).hexdigest()))
    length, angle = arm.units.length, arm.units.angle
    wide, plain = Instrument(), Errors()
    instrument = Instrument(
        kind,
        wide.noise if noise is None else length.to_si(noise),
        FINE.get(kind, wide.angle_noise) if angle_noise is None else angle.to_si(angle_noise),
        parse_frame(frame, arm),
    )
    wrong = Errors(
        plain.length if length_error is None else length.to_si(length_error),
        plain.angle if angle_error is None else angle.to_si(angle_error),
        tuple(_setting(text, arm) for text in settings),
    )
    streams = [np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(3)]
    truth = true_chain(arm.chain, wrong, streams[0])
    if at is None:
        q = sample_joints(arm.chain, poses, streams[1])
    else:
        _, q, _ = read_poses(at, arm.chain)
    if watch:
        watch({"stage": "simulating"})
    data = measure(truth, q, instrument, streams[2])
    about = f"{len(q)} configurations, seed {seed}, noise {length.from_si(instrument.noise):.6g} {length.name}"
    texts = simulated_files(arm, truth, data, about)
    refuse_existing(output, list(texts), force)
    largest = float(np.linalg.norm(truth.pose(q)[:, :3, 3] - arm.chain.pose(q)[:, :3, 3], axis=1).max())
    return Simulated(arm, truth, data, wrong, instrument, seed, largest, write_files(output, texts))


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
