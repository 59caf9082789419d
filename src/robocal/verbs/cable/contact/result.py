"""What `cable contact` finds: every motion of a path of one's own, and where it ends before its time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from robocal.cables.path import Legs, legs
from robocal.cables.workspace import Demand
from robocal.errors import FormatError, ModelError
from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.pose_lists import pose_columns, read_platform_poses
from robocal.files.parts import CableDocument
from robocal.files.text import InputFile
from robocal.quantities import Column, Listing
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.cable.start import clearance_of
from robocal.session.cable.statics_options import cable_document, mass_of, robot_inputs, robot_with_limits

__all__ = ["Motions", "path_of"]


@dataclass(frozen=True, kw_only=True)
class PathDocument(CableDocument):
    """contact.json."""

    whole: bool
    motions: Listing


@dataclass(frozen=True)
class Motions:
    """Names of the poses, what the motions between them meet, and what is to be said."""

    file: CableFile
    names: tuple[str, ...]
    legs: Legs
    demand: Demand | None
    from_first: bool
    remarks: tuple[Remark, ...]
    inputs: tuple[InputFile, ...]
    command: str

    @property
    def listing(self) -> Listing:
        """Of every motion: from, to, the share that can be gone, what ends it, and the pose where it ends."""
        met = self.legs.contacts.names(self.file.robot.cables)
        statics = self.legs.feasible_share < self.legs.contacts.fraction
        first = [self.names[0 if self.from_first else i] for i in range(len(met))]
        return Listing((
            Column("from", "", first),
            Column("to", "", self.names[1:]),
            Column("free", "", self.legs.free, digits=9, label="free share"),
            Column("ends by", "", ["the tension limits" if s else m or None for s, m in zip(statics, met, strict=True)]),
            *pose_columns(first, self.legs.end_poses)[1:],
        ))  # fmt: skip

    @property
    def table_listing(self) -> Listing:
        """What a table has of it."""
        return self.listing.only("from", "to", "free", "ends by")

    @property
    def whole(self) -> bool:
        """Whether all of it can be gone."""
        return bool(self.legs.whole.all())

    @property
    def document(self) -> PathDocument:
        """What --json says."""
        return cable_document(
            PathDocument, self.file.robot, self.remarks, self.inputs, self.command, whole=self.whole, motions=self.listing
        )  # fmt: skip


def path_of(o: Any, command: str = "") -> Motions:
    """A path by the options of the verb. Raises InputError."""
    file = read_cable(o.robot)
    si = o.si(file.units)
    rows = read_platform_poses(o.poses, file.robot)
    if len(rows.names) < 2:
        raise FormatError("a path needs two poses or more", file=o.poses, found=f"{len(rows.names)} rows")
    clearance, said = clearance_of(file, file.robot, si.diameter, o.body, si.relief)
    robot, demand = file.robot, None
    if (robot.limits is None and si.limits is None) or (robot.mass is None and si.mass is None):
        said = (*said, Remark.of(Code.TENSIONS_NOT_ASKED, robot=robot.name))
    else:
        robot = robot_with_limits(file, si.limits)
        demand = Demand(np.array([mass_of(file, si.payload, si.mass)]))
    try:
        found = legs(
            robot, rows.values, demand=demand, diameter=clearance.diameter, body=clearance.body, relief=clearance.relief,
            from_first=o.from_first,
        )  # fmt: skip
    except ModelError as error:
        raise FormatError(
            error.message, file=o.poses, key=error.key, found=error.found, expected=error.expected
        ) from None
    if open_ := int((~found.contacts.complete & ~(found.feasible_share < found.contacts.fraction)).sum()):
        said = (*said, Remark.of(Code.MOTIONS_OPEN, count=open_))
    inputs = (*robot_inputs(file, o.robot), InputFile(Path(o.poses), rows.sha256))
    return Motions(
        replace(file, robot=robot),
        rows.names,
        found,
        demand,
        o.from_first,
        (*file.warnings, *rows.warnings, *said),
        inputs,
        command,
    )
