"""What several verbs of cable robots take and say alike: what pulls at the platform and what its cables may bear, lists,
documents."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from robocal._types import Array
from robocal.cables.cable_lengths import model_of
from robocal.cables.geometry import CableRobot
from robocal.errors import FormatError, ModelError
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.pose_lists import WRENCH, CableList
from robocal.files.parts import CableDocument, provenance_of
from robocal.files.text import InputFile
from robocal.files.units import UNITS, in_si
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark, remark_fields

__all__ = [
    "balance_remarks", "cable_document", "limits_text", "mass_of", "missing_text", "name_option",
    "name_row", "no_direction", "redundant_robot", "robot_inputs", "robot_with_limits", "tensions_of", "wrench_of",
]  # fmt: skip

D = TypeVar("D", bound=CableDocument)
UPRIGHT = {2, 3, 4}  # components of the twist (v, w) that a weight works on: z, and the turns about x and y


def redundant_robot(file: CableFile, more: int = 0) -> CableRobot:
    """The robot, which has at least `more` cables than degrees of freedom. Raises FormatError naming the file."""
    cables, freedoms = len(file.robot.cables), len(file.robot.axes)
    if cables < freedoms + more:
        message = "no more cables than degrees of freedom: such cables balance some wrenches, never all"
        if cables < freedoms:
            message = "fewer cables than degrees of freedom: such a platform is not held by its cables"
        found, expected = f"{cables} cables for {freedoms} degrees of freedom", f"{freedoms + more} or more"
        raise FormatError(message, file=file.path, key="cables", found=found, expected=expected)
    return file.robot


def robot_with_limits(file: CableFile, limits: Array | None = None) -> CableRobot:
    """The robot as statics needs it: with no fewer cables than degrees of freedom, and tension limits, those of its file or
    (2,) in N for every cable. Raises FormatError naming the key that is missing, ModelError for limits that make no sense."""
    robot = redundant_robot(file)
    if limits is None:
        if robot.limits is None:
            message = f"the tension limits of {robot.name} are not known"
            expected = "every_cable: {tension: [LEAST, GREATEST]}, or --limits LEAST,GREATEST"
            raise FormatError(message, file=file.path, key="every_cable.tension", expected=expected)
        return robot
    if not 0 <= limits[0] < limits[1]:
        found, expected = ",".join(f"{file.units.force.from_si(float(v)):g}" for v in limits), "0 <= LEAST < GREATEST"
        raise ModelError("the tension limits are crossed or negative", key="--limits", found=found, expected=expected)
    return replace(robot, limits=np.tile(limits, (len(robot.cables), 1)))


def mass_of(file: CableFile, payload: float = 0.0, mass: float | None = None) -> float:
    """Mass of the platform (its file's, or `mass`) with a payload, in kg; zero where it is not known and does not matter: a
    planar robot that lies. Raises FormatError where it matters."""
    robot = file.robot
    if mass is not None:
        return mass + payload
    if robot.mass is None and UPRIGHT.intersection(robot.axes):
        message, expected = f"the mass of {robot.name} is not known", "platform: {mass: ...}, or --mass"
        raise FormatError(message, file=file.path, key="platform.mass", expected=expected)
    return (robot.mass or 0.0) + payload


def wrench_of(file: CableFile, wrench: str | None) -> Array:
    """ "FX,FY,FZ,MX,MY,MZ" (forces in the file's unit, moments in Nm, base axes) as (6,) in N and N m; zero for None.
    Raises ModelError."""
    if wrench is None:
        return np.zeros(6)
    units = [file.units.force] * 3 + [UNITS["Nm"]] * 3
    return in_si(wrench, "FX,FY,FZ,MX,MY,MZ", units, key="--wrench")


def balance_remarks(robot: CableRobot, wrenches: Array) -> tuple[Remark, ...]:
    """A remark on components of wrenches (..., 6) that this platform's cables do not balance."""
    given = (wrenches.reshape(-1, 6) != 0).any(axis=0)
    lost = tuple(WRENCH[i] for i in np.flatnonzero(given) if i not in robot.axes)
    return (Remark.of(Code.WRENCH_UNBALANCED, components=lost, degrees=robot.degrees),) if lost else ()


@contextmanager
def name_option(options: Mapping[str | None, str]) -> Iterator[None]:
    """What a model complains of by one of these keys is said of the option that stands for it."""
    try:
        yield
    except ModelError as error:
        if error.key not in options:
            raise
        facts: dict[str, Any] = {"found": error.found, "expected": error.expected, "suggestion": error.suggestion}
        raise ModelError(error.message, key=options[error.key], **facts) from None


def missing_text(robot: CableRobot, missing: Array) -> str:
    """A missing wrench (d,) [N, N m] in words; components that are nothing beside the greatest are left out."""
    size = np.abs(missing).max()
    parts = ((axis, v) for axis, v in zip(robot.axes, missing, strict=True) if abs(v) > 1e-6 * size)
    return ", ".join(f"{WRENCH[axis]} {v:.4g} {'N' if axis < 3 else 'Nm'}" for axis, v in parts)


def no_direction(cable: str, where: str) -> str:
    """What is wrong with a cable that has no length there."""
    return f"cable {cable} has no direction at {where}: its anchors coincide there, or the platform anchor lies in its pulley"


def robot_inputs(file: CableFile, robot: str) -> tuple[InputFile, ...]:
    """The robot's files, given as `robot`, as inputs of a result."""
    return (InputFile(file.path or Path(robot), file.sha256), *file.beside)


def tensions_of(
    rows: CableList, tension: float | None, file: CableFile, sag: bool
) -> tuple[Array | None, tuple[Remark, ...]]:
    """Tensions of the list, or one for all, in N, and a warning where those of the list stretch nothing, since nobody
    knows how elastic the cables are.

    Raises ModelError when both say, and for sag without tensions; FormatError naming the file where the robot does not know what the
    length model needs."""
    said: tuple[Remark, ...] = ()
    pull = None if rows.geometric else rows.tension
    if tension is not None:
        if rows.tension is not None:
            raise ModelError("tensions are given twice", key="--tension", found="columns of the list as well")
        if rows.geometric:
            expected = "a list of what the sensors show, or no tension"
            raise ModelError("geometric lengths are not stretched", key="--tension", expected=expected)
        pull = np.asarray(tension)
    elif pull is not None and file.robot.elasticity is None and not sag:
        pull, said = None, (Remark.of(Code.TENSIONS_ASIDE, robot=file.robot.name),)
    if sag and pull is None:
        expected = f"columns {file.robot.cables[0]}.tension [N], ... in the list, or --tension"
        raise ModelError("a sagging cable needs its tension", key="--sag", expected=expected)
    try:
        model_of(file.robot, sag=sag, tense=pull is not None)
    except ModelError as error:
        raise error.of_file(file.path) from None
    return pull, said


@contextmanager
def name_row(path: object, rows: CableList) -> Iterator[None]:
    """What a model complains of is said of the row of the list that it is about."""
    try:
        yield
    except ModelError as error:
        raise error.of_file(path, row=None if error.row is None else rows.lines[error.row]) from None


def cable_document(
    kind: type[D],
    robot: CableRobot,
    warnings: Sequence[Remark],
    inputs: Sequence[InputFile],
    command: str,
    **parts: Any,
) -> D:
    """The document of a verb: its own `parts`, about which robot, with what was assumed, remarked on and read."""
    return kind(
        robot=robot.name, cables=robot.cables, assumed=robot.assumed, **remark_fields(warnings),
        provenance=provenance_of(command, inputs), **parts
    )  # fmt: skip


def limits_text(limits: NDArray[np.float64]) -> str:
    """Tension limits (m, 2) N in words, each pair once."""
    return ", ".join(sorted({f"{low:g} to {high:g} N" for low, high in limits.tolist()}))
