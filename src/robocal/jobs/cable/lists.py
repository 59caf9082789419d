"""Lists of `cable inverse` and `cable forward`: their tensions, the length model that fits them, complaints by row."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from robocal.cables.inverse import model_of
from robocal.errors import FormatError, ModelError
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.lists import CableList
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["fitting", "located", "tensions_of"]

Array = NDArray[np.float64]


def tensions_of(
    rows: CableList, tension: float | None, file: CableFile, sag: bool
) -> tuple[Array | None, tuple[Remark, ...]]:
    """Tensions of the list, or one for all, in N, and a warning where those of the list stretch nothing, since nobody
    knows how elastic the cables are. Raises ModelError when both say, and for one that pushes."""
    if tension is not None:
        if rows.tension is not None:
            raise ModelError("tensions are given twice", key="--tension", found="columns of the list as well")
        if not 0 <= tension < math.inf:
            raise ModelError("a cable cannot push", key="--tension", found=tension, expected="0 or more")
        return np.asarray(file.units.force.to_si(tension)), ()
    if rows.tension is not None and file.robot.elasticity is None and not sag:
        return None, (Remark.of(Code.TENSIONS_ASIDE, robot=file.robot.name),)
    return rows.tension, ()


def located(error: ModelError, path: str, rows: CableList) -> FormatError:
    """What a model complains of, said of the row of the list that it is about."""
    row = None if error.row is None else rows.lines[error.row]
    return FormatError(error.message, file=path, row=row, key=error.key, found=error.found, expected=error.expected)


def fitting(file: CableFile, pull: Array | None, sag: bool) -> None:
    """Whether the robot's file knows what the length model needs. Raises FormatError naming it, or ModelError for sag
    without tensions."""
    if sag and pull is None:
        raise ModelError(
            "a sagging cable needs its tension",
            key="--sag",
            expected=f"columns {file.robot.cables[0]}.tension [N], ... in the list, or --tension",
        )
    try:
        model_of(file.robot, sag=sag, tense=pull is not None)
    except ModelError as error:
        raise FormatError(error.message, file=file.path, key=error.key, expected=error.expected) from None
