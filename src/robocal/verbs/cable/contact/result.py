"""What `cable contact` finds: every motion of a path of one's own, and where it ends before its time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robocal.cables.path import Legs, legs
from robocal.cables.workspace import Demand
from robocal.errors import FormatError, ModelError
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.lists import read_platform_poses
from robocal.files.cable.robot import read_cable
from robocal.files.csvtable import csv_text
from robocal.files.text import InputFile
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.cable.load import framed, held_robot, mass_of, robot_inputs
from robocal.session.cable.start import clearance_of

__all__ = ["Path", "path_of"]


@dataclass(frozen=True)
class Path:
    """Names of the poses, what the motions between them meet, and what is to be said."""

    file: CableFile
    names: tuple[str, ...]
    found: Legs
    demand: Demand | None
    from_first: bool
    remarks: tuple[Remark, ...]
    inputs: tuple[InputFile, ...]
    command: str

    @property
    def rows(self) -> list[tuple[str, str, float, str]]:
        """Of every motion: from, to, the share that can be gone, and what ends it."""
        met = self.found.contacts.names(self.file.robot.cables)
        out = []
        for i, free in enumerate(self.found.free):
            statics = self.found.held[i] < self.found.contacts.fraction[i]
            why = "the tension limits" if statics else met[i]
            out.append((self.names[0 if self.from_first else i], self.names[i + 1], float(free), why))
        return out

    @property
    def whole(self) -> bool:
        """Whether all of it can be gone."""
        return bool(self.found.whole.all())

    @property
    def text(self) -> str:
        """The same as CSV."""
        return csv_text(["from", "to", "free", "ends by"], [[a, b, f"{x:.9g}", why] for a, b, x, why in self.rows])

    @property
    def document(self) -> dict[str, Any]:
        """What --json says."""
        motions = [
            {"from": a, "to": b, "free": x, "ends_by": why or None, "T_base_platform": t.tolist()}
            for (a, b, x, why), t in zip(self.rows, self.found.reached, strict=True)
        ]
        return framed(
            self.file.robot, {"whole": self.whole, "motions": motions}, self.remarks, self.inputs, self.command
        )


def path_of(o: Any, command: str = "") -> Path:
    """A path by the options of the verb. Raises InputError."""
    from pathlib import Path as FilePath

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
        robot = held_robot(file, si.limits)
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
    if open_ := int((~found.contacts.resolved & ~(found.held < found.contacts.fraction)).sum()):
        said = (*said, Remark.of(Code.MOTIONS_OPEN, count=open_))
    inputs = (*robot_inputs(file, o.robot), InputFile(FilePath(o.poses), rows.sha256))
    return Path(
        replace(file, robot=robot),
        rows.names,
        found,
        demand,
        o.from_first,
        (*file.warnings, *rows.warnings, *said),
        inputs,
        command,
    )
