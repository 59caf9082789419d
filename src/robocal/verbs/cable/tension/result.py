"""What `cable tension` finds, lists, remarks on and doubts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocal.cables.geometry import CableRobot
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import Distribution, capacity_margin, distribute
from robocal.errors import FormatError, ModelError
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.lists import WRENCH, CableList, platform_text, read_platform_poses, tension_columns
from robocal.files.cable.robot import read_cable
from robocal.files.cable.values import CableUnits
from robocal.files.text import InputFile
from robocal.files.units import number
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.cable.load import (
    framed,
    held_robot,
    mass_of,
    missing_text,
    robot_inputs,
    said_of,
    unbalanced,
    wrench_of,
)

__all__ = ["Tensions", "held"]

Array = NDArray[np.float64]
MOMENT = "Nm"
LEANING = np.sin(np.radians(5.0))  # of a cable that leaves a planar robot's plane further than it should
NOTHING = 1e-9  # of the greatest limit: rounding
MOST = 5


def held(o: Any, power: float, command: str = "") -> Tensions:
    """Tensions with what they hold, margins and missing wrenches, by the options of the verb. Raises InputError."""
    file = read_cable(o.robot)
    si = o.si(file.units)
    able, weight, lever = held_robot(file, si.limits), mass_of(file, si.payload, si.mass), si.length or 1.0
    rows = read_platform_poses(o.poses, able)
    structure = _structures(able, rows, o.poses)
    extra = wrench_of(file, o.wrench) + (0.0 if rows.wrench is None else rows.wrench)
    load = (gravity_wrench(rows.values, weight, able.com) + extra)[:, able.axes]
    with said_of({"method": "--method", "power": "--power"}):
        spread = distribute(structure, load, able.need("limits"), o.method, power)
        if o.power is not None and o.method != "p-norm":
            raise ModelError("a power is only for the p-norm", key="power", found=o.power, expected="--method p-norm")
    margin = capacity_margin(structure, load, able.need("limits"), able.lengths_of_rows(lever))
    missing = spread.missing(able.lengths_of_rows(lever))
    return Tensions(
        file.units, able, rows.names, rows.values, spread, margin, missing, power, lever, weight,
        _listed(able, rows, spread, margin, missing, file),
        (*file.warnings, *rows.warnings, *unbalanced(able, extra), *_leaning(able, rows), *_bare(able, rows.names, spread, margin)),
        _doubts(able, rows.names, spread, missing),
        (*robot_inputs(file, o.robot), InputFile(Path(o.poses), rows.sha256)), command,
    )  # fmt: skip


def _structures(robot: CableRobot, rows: CableList, poses: str) -> Array:
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


def _listed(
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
    if not robot.planar:
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


@dataclass(frozen=True, eq=False)
class Tensions:
    """Tensions of k poses with what they hold: `spread` as `tension.distribute` gives it, in N and N m; capacity
    margins (k,) in N; missing wrenches (k, d) along `robot.axes`; the CSV; and `doubts`: which poses are not held."""

    units: CableUnits
    robot: CableRobot
    names: tuple[str, ...]
    poses: Array
    spread: Distribution
    margin: Array
    missing: Array
    power: float
    length: float
    mass: float
    text: str
    warnings: tuple[Remark, ...]
    doubts: tuple[Remark, ...]
    inputs: tuple[InputFile, ...]
    command: str = ""

    @property
    def axes(self) -> tuple[str, ...]:
        """The components of wrenches, by name."""
        return tuple(WRENCH[i] for i in self.robot.axes)

    @property
    def used_power(self) -> float | None:
        """The power of the sum, of a method that has one."""
        return self.power if self.spread.method == "p-norm" else None

    @property
    def borne(self) -> dict[str, Array]:
        """Least, mean and greatest tension of each cable over the poses that have tensions, N, (cables,) each; nothing where none has."""
        t = self.spread.tension[self.spread.found]
        return {"least": t.min(axis=0), "mean": t.mean(axis=0), "greatest": t.max(axis=0)} if len(t) else {}

    @property
    def document(self) -> dict[str, Any]:
        """What tension.json holds."""
        spread = self.spread
        rows = zip(self.names, spread.tension, self.margin, self.missing, spread.wrench, strict=True)
        found = {
            "method": spread.method,
            "power": self.used_power,
            "limits_N": spread.limits,
            "mass_kg": self.mass,
            "length_m": self.length,
            "wrenches": {"axes": self.axes, "unit": "N, N m"},
            "feasible": int(spread.feasible.sum()),
            "tensions_N": self.borne,
            "poses": [
                {
                    "name": name,
                    "T_base_platform": self.poses[i],
                    "feasible": bool(spread.feasible[i]),
                    "tension_N": tension if spread.found[i] else None,
                    "margin_N": margin,
                    "wrench": wrench,
                    "missing": None if spread.feasible[i] else missing,
                }
                for i, (name, tension, margin, missing, wrench) in enumerate(rows)
            ],
        }
        said = (*self.warnings, *self.doubts)
        return framed(self.robot, found, warnings=said, inputs=self.inputs, command=self.command)
