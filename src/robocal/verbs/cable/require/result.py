"""What `cable require` finds: the errors of a calibration that nobody has made yet, and what a smaller error takes."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.cables.calibration.exact import flat
from robocal.cables.calibration.propagation import ErrorPropagation, Noise
from robocal.cables.calibration.requirement import ESTIMATORS, Requirement
from robocal.cables.geometry import CableRobot
from robocal.errors import FormatError, ModelError
from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.pose_lists import read_platform_poses
from robocal.files.parts import CableDocument
from robocal.files.text import InputFile
from robocal.files.units import parse_quantity
from robocal.quantities import Column, Listing, UnitValue, unit_value
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.cable.statics_options import cable_document, robot_inputs

__all__ = ["PAIRS", "Required", "compute_requirement"]

PAIRS = (("length", "position"), ("position", "orientation"), ("length", "orientation"))
AWAY = 5.0  # times what the frame anchors scatter by
LEVELS = (0.5, 1.0, 2.0)  # of the error that is asked for: lines of equal error


@dataclass(frozen=True, kw_only=True)
class Accuracy:
    """An accuracy that is asked for, whether it is reached, and what takes it there: all noises times `scale`, one of them alone, or so
    many poses."""

    of: str
    value: float | None
    unit: str
    reached: bool
    scale: float
    alone: dict[str, UnitValue | None]
    poses: Any


@dataclass(frozen=True, kw_only=True)
class RequireDocument(CableDocument):
    """require.json."""

    poses: int
    noise: dict[str, UnitValue]
    estimator: str
    expected: dict[str, dict[str, UnitValue]]
    sigma: Listing
    accuracy: Accuracy | None


@dataclass(frozen=True, eq=False)
class Required:
    """A requirement with the accuracy (m or rad) of `of` that is asked for, and what the files say."""

    file: CableFile
    requirement: Requirement
    of: str
    accuracy: float | None
    remarks: tuple[Remark, ...]
    inputs: tuple[InputFile, ...]
    command: str

    @property
    def robot(self) -> CableRobot:
        """The robot as its file has it."""
        return self.file.robot

    @property
    def si(self) -> str:
        """The unit of the error that is asked for."""
        return "rad" if self.of == "orientation" else "m"

    @cached_property
    def enough(self) -> bool:
        """Whether the accuracy is reached as things are."""
        return self.accuracy is None or self.requirement.scale(self.of, self.accuracy) >= 1.0

    @cached_property
    def sigma(self) -> Array:
        """One standard deviation of what is sought of every cable, its zero last, (m, k) in m."""
        m = len(self.robot.cables)
        return np.sqrt(np.diag(self.requirement.covariance)).reshape(m, -1)

    @cached_property
    def needs(self) -> dict[str, Any] | None:
        """What the accuracy takes: all noises times `scale`, one of them alone, or so many poses."""
        if self.accuracy is None:
            return None
        r = self.requirement
        return {
            "scale": r.scale(self.of, self.accuracy),
            "alone": r.alone(self.of, self.accuracy),
            "poses": r.poses(self.of, self.accuracy),
        }

    @cached_property
    def curves(self) -> dict[tuple[str, str], list[tuple[float, Array]]]:
        """Lines of equal error, every cable by itself, for the pairs of noises of which both are there: errors and (n, 2)."""
        r = self.requirement
        middle = self.accuracy
        if middle is None:
            middle = float(getattr(replace(r, estimator="per-cable").rms_errors, self.of))
        there = [p for p in PAIRS if all(getattr(r.noise, name) for name in p)]
        return {p: [(f * middle, r.contour(self.of, f * middle, p)) for f in LEVELS] for p in there}

    @property
    def lines(self) -> Listing:
        """The same as rows, in SI."""
        rows = [
            (level, one, a, two, b)
            for (one, two), curves in self.curves.items()
            for level, curve in curves
            for a, b in curve.tolist()
        ]
        heads = (("error", self.si), ("first noise", ""), ("first", "SI"), ("second noise", ""), ("second", "SI"))
        values = list(zip(*rows, strict=True)) or [()] * len(heads)
        return Listing(tuple(Column(n, u, v, digits=9) for (n, u), v in zip(heads, values, strict=True)))

    @property
    def sigmas(self) -> Listing:
        """One row per cable: one standard deviation of what is sought of it."""
        names = [*(f"a{'xyz'[i]}" for i in self.requirement.design.axes), "l0"]
        columns = (Column(n, "m", v) for n, v in zip(names, self.sigma.T, strict=True))
        return Listing((Column("cable", "", self.robot.cables), *columns))

    @property
    def document(self) -> RequireDocument:
        """What --json says."""
        r, si = self.requirement, {"orientation": "rad"}
        expected = {
            name: {k: UnitValue(v, si.get(k, "m")) for k, v in asdict(replace(r, estimator=name).rms_errors).items()}
            for name in ESTIMATORS
        }
        noise = {
            name: UnitValue(getattr(r.noise, name), si.get(name, "m")) for name in ("length", "position", "orientation")
        }
        return cable_document(
            RequireDocument, self.robot, self.remarks, self.inputs, self.command, poses=len(r.design.poses), noise=noise,
            estimator=r.estimator, expected=expected, sigma=self.sigmas,
            accuracy=None if self.needs is None else self._accuracy(self.needs),
        )  # fmt: skip

    def _accuracy(self, needed: dict[str, Any]) -> Accuracy:
        """A noise that hardly counts is left out of `alone`; null there is one that alone cannot do it."""
        alone = {
            k: unit_value(v, "rad" if k == "orientation" else "m")
            for k, v in needed["alone"].items()
            if v is None or np.isfinite(v)
        }
        return Accuracy(
            of=self.of, value=self.accuracy, unit=self.si, reached=self.enough, scale=needed["scale"], alone=alone, poses=needed["poses"]
        )  # fmt: skip


def compute_requirement(o: Any, command: str = "") -> Required:
    """The requirement by the options of the verb. Raises InputError."""
    file = read_cable(o.robot)
    rows = read_platform_poses(o.poses, file.robot)
    sigma = (
        ("--sigma", o.sigma, "m"),
        ("--sigma-position", o.sigma_position, "m"),
        ("--sigma-orientation", o.sigma_orientation, "rad"),
    )
    noise = Noise(*(0.0 if text is None else parse_quantity(text, si, key=key) for key, text, si in sigma))
    if noise.orientation and max(file.robot.axes) < 3:
        degrees = file.robot.degrees
        raise ModelError(
            "this platform does not turn",
            key="--sigma-orientation",
            found=o.sigma_orientation,
            expected=f"none: it is {degrees}",
        )
    si = "rad" if o.of == "orientation" else "m"
    accuracy = None if o.accuracy is None else parse_quantity(o.accuracy, si, key="--accuracy")
    least = sum(i < 3 for i in file.robot.axes) + 1
    if len(rows.values) < least:
        raise FormatError(
            "too few poses for the anchor and the zero of a cable",
            file=o.poses,
            found=len(rows.values),
            expected=f"{least} or more",
        )
    requirement = Requirement(ErrorPropagation(file.robot, rows.values), noise, o.estimator)
    try:
        error = getattr(requirement.rms_errors, o.of)
    except ModelError as bad:
        raise FormatError(bad.message, file=o.poses, key=bad.key, found=bad.found, expected=bad.expected) from None
    if not np.isfinite(error):
        raise FormatError(
            f"no {o.of} follows from the lengths of this robot: fewer cables than degrees of freedom", file=file.path, key="cables",
            found=f"{len(file.robot.cables)} cables for {len(file.robot.axes)} degrees of freedom", expected="--of anchors or --of zeros",
        )  # fmt: skip
    inputs = (*robot_inputs(file, o.robot), InputFile(Path(o.poses), rows.sha256))
    said = (*file.warnings, *rows.warnings, *_spread(file.robot, rows.values))
    return Required(file, requirement, o.of, accuracy, said, inputs, command)


def _spread(robot: CableRobot, poses: Array) -> tuple[Remark, ...]:
    """What is to be said of a list that tells no anchor from its mirror image, and of one that is not about this robot."""
    axes = [i for i in robot.axes if i < 3]
    shapes = [flat(poses[:, :3, 3] + poses[:, :3, :3] @ b, axes) for b in robot.b]
    mirrored = tuple(c for c, s in zip(robot.cables, shapes, strict=True) if s is not None)
    out = []
    if mirrored:
        shape = next(s for s in shapes if s is not None)
        out.append(Remark.of(Code.MIRROR_IMAGE, cables=mirrored, shape=shape))
    size = float(np.linalg.norm(robot.a.std(axis=0)))
    away = float(np.median(np.linalg.norm(poses[:, :3, 3] - robot.home[:3, 3], axis=1)))
    if away > AWAY * size:
        out.append(Remark.of(Code.POSES_AWAY, away=Quantity(away), size=Quantity(size)))
    return tuple(out)
