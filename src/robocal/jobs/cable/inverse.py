"""The verb `cable inverse`: lengths of the cables at given poses of the platform."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocal.cables.geometry import CableRobot
from robocal.cables.inverse import inverse
from robocal.errors import ModelError
from robocal.files.cable.lists import lengths_text, read_platform_poses
from robocal.files.cable.robot import read_cable
from robocal.files.dataset import InputFile
from robocal.files.writing import write_text
from robocal.jobs.cable.document import framed
from robocal.jobs.cable.lists import fitting, located, tensions_of
from robocal.jobs.cable.load import robot_input
from robocal.jobs.simulate import refuse_existing
from robocal.remarks.remark import Remark

__all__ = ["Lengths", "cable_inverse"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Lengths:
    """Lengths (k, m) in m by name of the pose, the CSV, what is odd about the robot, and where the CSV was written."""

    robot: CableRobot
    names: tuple[str, ...]
    lengths: Array
    text: str
    warnings: tuple[Remark, ...]
    inputs: tuple[InputFile, ...]
    command: str = ""
    written: Path | None = None

    @property
    def document(self) -> dict[str, Any]:
        """What --json prints."""
        found = {"lengths_m": dict(zip(self.names, self.lengths, strict=True))}
        return framed(self.robot, found, warnings=self.warnings, inputs=self.inputs, command=self.command)


def cable_inverse(
    robot: str,
    poses: str,
    *,
    tension: float | None = None,
    sag: bool = False,
    output: Path | None = None,
    force: bool = False,
    command: str = "",
) -> Lengths:
    """Lengths from poses; `tension` in the robot file's unit of force is that of every cable where the list has no
    columns of its own. Raises InputError."""
    if output is not None:
        refuse_existing(output.parent, (output.name,), force)
    file = read_cable(robot)
    rows = read_platform_poses(poses, file.robot)
    pull, warnings = tensions_of(rows, tension, file, sag)
    fitting(file, pull, sag)
    try:
        lengths, _ = inverse(file.robot, rows.values, pull, sag=sag)
    except ModelError as error:
        raise located(error, poses, rows) from None
    text = lengths_text(file.robot, rows.names, lengths, file.units, rows.tension)
    return Lengths(
        file.robot, rows.names, lengths, text, (*file.warnings, *rows.warnings, *warnings),
        (robot_input(file, robot), InputFile(Path(poses), rows.sha256)), command,
        None if output is None else write_text(output, text),
    )  # fmt: skip
