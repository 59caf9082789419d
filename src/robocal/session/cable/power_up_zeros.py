"""Zeros of a cable robot whose sensors were switched on anew: what they show at known poses is what the robot's lengths are there.

    l0_i = mean over poses (full_i(T_j) - g_i y_ij),    with stretch full / (1 + e t) in place of full

Gains, anchors and everything else stay as they were identified.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy.special

from robocal._record import record
from robocal._types import Array
from robocal.cables.cable_lengths import inverse
from robocal.diagnose.limits import LENGTHS_UNLIKELY
from robocal.errors import FormatError, ModelError
from robocal.files.cable.pose_lists import CableList, read_cable_lengths, read_platform_poses
from robocal.files.cable.write import render_cable
from robocal.files.parts import CableDocument
from robocal.files.text import InputFile
from robocal.quantities import Column, Listing, UnitValue, unit_value
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.cable.cable_result import CableResult
from robocal.session.cable.calibrated import open_robot
from robocal.session.cable.start import pose_of
from robocal.session.cable.statics_options import name_row, robot_inputs, tensions_of

__all__ = ["Rezeroed", "find_zeros"]


@record(kw_only=True)
class ZerosDocument(CableDocument):
    """What --json prints: zeros before and after, and by how much those of single poses differ (rms)."""

    poses: int
    zeros: Listing
    sigma: UnitValue | None
    text: str


@record(kw_only=True, eq=False)
class Rezeroed(CableResult):
    """Zeros (m,) in m that follow from every pose, (k, m), and the text of the robot's file with their means."""

    each: Array
    before: Array
    sigma: float | None
    text: str

    @property
    def zeros(self) -> Listing:
        """One row for each cable."""
        after = self.each.mean(axis=0)
        spread = np.std(self.each, axis=0, ddof=1) if len(self.each) > 1 else [None] * self.each.shape[1]
        return Listing((
            Column("cable", "", self.robot.cables),
            Column("zero before", "m", self.before),
            Column("zero", "m", after),
            Column("change", "m", after - self.before),
            Column("differs by", "m", spread),
        ))  # fmt: skip

    @property
    def printed(self) -> tuple[str, None]:
        """The robot's file."""
        return self.text, None

    @property
    def document(self) -> ZerosDocument:
        """What --json says."""
        sigma = unit_value(self.sigma, "m")
        return self.document_of(ZerosDocument, poses=len(self.each), zeros=self.zeros, sigma=sigma, text=self.text)


def find_zeros(o: Any, command: str = "") -> Rezeroed:
    """Zeros by the options of the verb. Raises InputError."""
    file = open_robot(o.robot, zeros=False)
    robot, si = file.robot, o.si(file.units)
    rows = read_cable_lengths(o.lengths, robot)
    if rows.geometric:
        expected = f"columns {robot.cables[0]}, ...: what the sensors show"
        raise FormatError("geometric lengths have no zeros", file=o.lengths, expected=expected)
    if robot.states_build_up:
        raise ModelError(
            "of a drum that grows with every turn the gain depends on where its sensor counts from", key=f"{robot.cables[0]}.build_up",
            expected="an identification with the lengths of this power-up",
        )  # fmt: skip
    pull, said = tensions_of(rows, si.tension, file, False)
    poses, inputs = _known_poses(o, file, rows)
    with name_row(o.lengths, rows):
        model = inverse(robot, poses, pull)[0]
    each = robot.zeros + robot.gain * (model - rows.values)
    zeros = {f"{c}.l0": float(v) for c, v in zip(robot.cables, each.mean(axis=0), strict=True)}
    text, lost = render_cable(file, zeros)
    if lost:
        raise FormatError("this file has no room for zeros", file=file.path, key="cables", found=", ".join(lost))
    if robot.elasticity is not None and pull is None:
        said = (*said, Remark.of(Code.LENGTHS_TAKEN_GEOMETRIC, robot=robot.name))
    if len(each) == 1:
        said = (*said, Remark.of(Code.ZEROS_OF_ONE_POSE))
    return Rezeroed(
        file=file, each=each, before=robot.zeros, sigma=si.sigma, text=text,
        reasons=_scatter(file.robot.gain, each, si.sigma, robot.cables),
        warnings=(*file.warnings, *rows.warnings, *said), command=command,
        inputs=(*robot_inputs(file, o.robot), InputFile(Path(o.lengths), rows.sha256), *inputs),
    )  # fmt: skip


def _known_poses(o: Any, file: Any, rows: CableList) -> tuple[Array, tuple[InputFile, ...]]:
    """Where the platform stood at every row (k, 4, 4): one pose of all, or that of its id in a list. Raises InputError."""
    if (o.at is None) == (o.poses is None):
        found = "neither" if o.at is None else "both"
        raise ModelError("where did the platform stand?", key="--at", found=found, expected="--at or --poses")
    if o.at is not None:
        return np.repeat(pose_of(file, file.robot, o.at, "--at")[None], len(rows.names), axis=0), ()
    known = read_platform_poses(o.poses, file.robot)
    at = {name: i for i, name in enumerate(known.names)}
    for name, line in zip(rows.names, rows.lines, strict=True):
        if name not in at:
            raise FormatError(
                "no pose has this id", file=o.lengths, row=line, found=name, expected=f"an id of {o.poses}"
            )
    return known.values[[at[n] for n in rows.names]], (InputFile(Path(o.poses), known.sha256),)


def _scatter(gain: Array, each: Array, sigma: float | None, cables: tuple[str, ...]) -> tuple[Remark, ...]:
    """A reason where zeros of single poses differ by more than the stated noise of a length makes them."""
    if sigma is None or len(each) < 2:
        return ()
    left = (each - each.mean(axis=0)) / (gain * sigma)
    worst = int((left**2).sum(axis=0).argmax())
    dof = left.size - left.shape[1]
    if scipy.special.gammaincc(0.5 * dof, 0.5 * float((left**2).sum())) >= LENGTHS_UNLIKELY:
        return ()
    most = Quantity(float(np.ptp(each[:, worst])))
    return (Remark.of(Code.ZEROS_DISAGREE, cable=cables[worst], most=most, sigma=Quantity(sigma)),)
