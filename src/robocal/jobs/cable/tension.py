"""The verb `cable tension`: tensions that hold the platform at given poses, or the wrench that is missing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from robocal.cables.geometry import CableRobot
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import Distribution, capacity_margin, distribute
from robocal.errors import FormatError, ModelError
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.lists import WRENCH, CableList, platform_text, read_platform_poses, tension_columns
from robocal.files.cable.robot import read_cable
from robocal.files.dataset import InputFile
from robocal.files.units import number
from robocal.files.writing import write_files
from robocal.jobs.cable.load import held_robot, lever_of, mass_of, missing_text, robot_input, said_of, wrench_of
from robocal.jobs.cable.tension_result import Tensions
from robocal.jobs.plain import json_text
from robocal.jobs.simulate import refuse_existing
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["cable_tension"]

Array = NDArray[np.float64]
FILES = ("tensions.csv", "tension.json", "report.html")
MOMENT = "Nm"
LEANING = np.sin(np.radians(5.0))  # of a cable that leaves a planar robot's plane further than it should
NOTHING = 1e-9  # of the greatest limit: rounding
MOST = 5
POWER = 4.0  # of a p-norm that says none


def cable_tension(
    robot: str,
    poses: str,
    *,
    method: str = "norm",
    power: float | None = None,
    mass: float | None = None,
    payload: float = 0.0,
    wrench: str | None = None,
    limits: str | None = None,
    length: float | None = None,
    output: Path | None = None,
    force: bool = False,
    command: str = "",
) -> Tensions:
    """Tensions at poses; `mass` stands for the platform's own and `payload` hangs at its centre (the file's unit of
    mass), `wrench` and `limits` are those of `jobs.cable.load`, `length` (the file's unit, one metre by default) compares
    moments with forces. `output` gets FILES. Raises InputError."""
    if output is not None:
        refuse_existing(output, FILES, force)
    file = read_cable(robot)
    able, weight = held_robot(file, limits), mass_of(file, payload, mass)
    rows = read_platform_poses(poses, able)
    lever = lever_of(file, length)
    structure = _structure(able, rows, poses)
    extra = wrench_of(file, wrench) + (0.0 if rows.wrench is None else rows.wrench)
    load = (gravity_wrench(rows.values, weight, able.com) + extra)[:, able.axes]
    exponent = POWER if power is None else power
    with said_of({"method": "--method", "power": "--power"}):
        spread = distribute(structure, load, able.need("limits"), method, exponent)
        if power is not None and method != "p-norm":
            raise ModelError("a power is of the p-norm alone", key="power", found=power, expected="--method p-norm")
    margin = capacity_margin(structure, load, able.need("limits"), lever)
    missing = spread.missing(lever)
    made = Tensions(
        able, rows.names, rows.values, spread, margin, missing, exponent, lever, weight,
        _text(able, rows, spread, margin, missing, file),
        (*file.warnings, *rows.warnings, *_leaning(able, rows), *_bare(able, rows.names, spread, margin)),
        _doubts(able, rows.names, spread, missing),
        (robot_input(file, robot), InputFile(Path(poses), rows.sha256)), command,
    )  # fmt: skip
    return made if output is None else _save(made, output)


def _structure(robot: CableRobot, rows: CableList, poses: str) -> Array:
    """Structure matrices at all poses. Raises FormatError naming the row where a cable has no direction."""
    out = structure_of(robot, rows.values, strict=False)
    bad = ~np.isfinite(out).all(axis=1)
    if bad.any():
        row, cable = (int(v) for v in np.argwhere(bad)[0])
        raise FormatError(
            f"cable {robot.cables[cable]} has no direction at {rows.names[row]}: its anchors coincide there, or the "
            "platform anchor lies in its pulley",
            file=poses,
            row=rows.lines[row],
            key=robot.cables[cable],
        )
    return out


def _text(
    robot: CableRobot, rows: CableList, spread: Distribution, margin: Array, missing: Array, file: CableFile
) -> str:
    """The list: poses, tensions under the names that `cable inverse` and `forward` read, and what is missing."""
    unit = file.units.force
    more = dict(tension_columns(robot, spread.tension, file.units))
    more["feasible"] = ["yes" if ok else "no" for ok in spread.feasible]
    more[f"margin [{unit.name}]"] = [number(float(f"{unit.from_si(float(v)):.6g}")) for v in margin]
    for i, axis in enumerate(robot.axes):
        shown = unit.name if axis < 3 else MOMENT
        values = unit.from_si(missing[:, i]) if axis < 3 else missing[:, i]
        cells = ["" if ok else number(float(f"{v:.6g}")) for v, ok in zip(values, spread.feasible, strict=True)]
        more[f"missing.{WRENCH[axis]} [{shown}]"] = cells
    return platform_text(rows.names, rows.values, file.units, more)


def _doubts(robot: CableRobot, names: tuple[str, ...], spread: Distribution, missing: Array) -> tuple[Remark, ...]:
    """Poses that no tensions hold, and those that this method has none for."""
    out = []
    for i in np.flatnonzero(~spread.feasible):
        out.append(Remark.of(Code.NOT_HELD, pose=names[i], missing=missing_text(robot, missing[i])))
    for i in np.flatnonzero(spread.feasible & ~spread.found):
        out.append(Remark.of(Code.CLOSED_FORM_LEAVES, pose=names[i]))
    left = len(out) - MOST
    return (*out[:MOST], Remark.of(Code.AND_MORE, count=left)) if left > 0 else tuple(out)


def _bare(robot: CableRobot, names: tuple[str, ...], spread: Distribution, margin: Array) -> tuple[Remark, ...]:
    """Poses that are held as they are and in no other way: singular ones, mostly."""
    bare = [names[i] for i in np.flatnonzero(spread.feasible & (margin <= NOTHING * robot.need("limits").max()))]
    if not bare:
        return ()
    more = len(bare) - MOST
    return (Remark.of(Code.NO_MARGIN, poses=tuple(bare[:MOST]), more=more if more > 0 else None),)


def _leaning(robot: CableRobot, rows: CableList) -> tuple[Remark, ...]:
    """Cables that leave the plane of a planar robot: what they pull across it is held by nothing."""
    if robot.degrees == "3R3T":
        return ()
    across = 2 if robot.plane == "xy" else 1
    whole = replace(robot, degrees="3R3T")
    lean = np.abs(structure_of(whole, rows.values, strict=False)[:, across])
    if not lean.max(initial=0.0) > LEANING:
        return ()
    row, cable = (int(v) for v in np.unravel_index(int(np.argmax(lean)), lean.shape))
    angle = Quantity(float(np.arcsin(min(float(lean[row, cable]), 1.0))), "rad")
    where = {"pose": rows.names[row], "cable": robot.cables[cable], "plane": robot.plane}
    return (Remark.of(Code.LEANING, **where, angle=angle),)


def _save(made: Tensions, output: Path) -> Tensions:
    """Writes the list, the document and the page."""
    from robocal.jobs.cable.tension_page import tension_page

    texts = dict(zip(FILES, (made.text, json_text(made.document), tension_page(made)), strict=True))
    return replace(made, written=write_files(output, texts))
