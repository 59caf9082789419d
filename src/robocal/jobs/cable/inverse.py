"""The verb `cable inverse`: lengths of the cables at given poses of the platform."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from robocal.cables.geometry import CableRobot
from robocal.cables.inverse import inverse, model_of
from robocal.errors import FileError, FormatError, ModelError
from robocal.files.cable.lists import CableList, lengths_text, read_platform_poses
from robocal.files.cable.robot import CableFile, read_cable
from robocal.files.text import write_text

__all__ = ["Lengths", "cable_inverse", "fitting", "located", "tensions_of", "written"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Lengths:
    """Lengths (k, m) in m by name of the pose, the CSV, where it was written, and what is odd about the robot."""

    robot: CableRobot
    names: tuple[str, ...]
    lengths: Array
    text: str
    written: Path | None
    warnings: tuple[str, ...]


def cable_inverse(
    robot: str,
    poses: str,
    *,
    tension: float | None = None,
    sag: bool = False,
    output: Path | None = None,
    force: bool = False,
) -> Lengths:
    """Lengths from poses; `tension` in the robot file's unit of force is that of every cable where the list has no
    columns of its own. Raises InputError."""
    file = read_cable(robot)
    rows = read_platform_poses(poses, file.robot)
    pull, warnings = tensions_of(rows, tension, file, sag)
    fitting(file, pull, sag)
    try:
        lengths, _ = inverse(file.robot, rows.values, pull, sag=sag)
    except ModelError as error:
        raise located(error, poses, rows) from None
    text = lengths_text(file.robot, rows.names, lengths, file.units, rows.tension)
    place = written(output, text, force)
    return Lengths(file.robot, rows.names, lengths, text, place, (*file.warnings, *warnings))


def tensions_of(
    rows: CableList, tension: float | None, file: CableFile, sag: bool
) -> tuple[Array | None, tuple[str, ...]]:
    """Tensions of the list, or one for all, in N, and a warning where those of the list stretch nothing, since nobody
    knows how elastic the cables are. Raises ModelError when both say, and for one that pushes."""
    if tension is not None:
        if rows.tension is not None:
            raise ModelError("tensions are given twice", key="--tension", found="columns of the list as well")
        if not 0 <= tension < math.inf:
            raise ModelError("a cable cannot push", key="--tension", found=tension, expected="0 or more")
        return np.asarray(file.units.force.to_si(tension)), ()
    if rows.tension is not None and file.robot.elasticity is None and not sag:
        return None, (f"tensions of the list are left aside: the elasticity of {file.robot.name} is not known",)
    return rows.tension, ()


def located(error: ModelError, path: str, rows: CableList) -> FormatError:
    """What a model complains of, said of the row of the list that it is about."""
    row = None if error.row is None else rows.lines[error.row]
    return FormatError(error.message, file=path, row=row, key=error.key, found=error.found, expected=error.expected)


def fitting(file: CableFile, pull: Array | None, sag: bool) -> None:
    """Whether the robot's file knows what the length model needs. Raises FormatError naming it, or ModelError."""
    try:
        model_of(file.robot, sag=sag, tense=pull is not None)
    except ModelError as error:
        if error.key == "tension":
            raise
        raise FormatError(error.message, file=file.path, key=error.key, expected=error.expected) from None


def written(output: Path | None, text: str, force: bool) -> Path | None:
    """Writes the text, unless nobody asked or a file is in the way."""
    if output is None:
        return None
    if output.exists() and not force:
        raise FileError(
            "this file exists and is left as it is", file=output, expected="--force to replace it, or another name"
        )
    return write_text(output, text)
