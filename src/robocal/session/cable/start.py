"""What several verbs of cable robots make of their options, in the units of the robot's file: where a list of poses starts, what the
platform looks like to its cables, and the box Z."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.cables.grid_regions import frame_box
from robocal.cables.interference import Body, box, hull
from robocal.cables.list_start import CELLS, Clearance, Start, examine, propose
from robocal.cables.pose_list import PoseBox
from robocal.cables.statics import structure_of
from robocal.diagnose.limits import BOX_LARGEST
from robocal.errors import ModelError
from robocal.files.cable.cablefile import CableFile
from robocal.files.units import in_si
from robocal.geometry import se3, so3
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.cable.statics_options import missing_text, no_direction

__all__ = ["body_of", "box_of", "clearance_of", "examine_start", "pose_of"]

TURN = math.radians(30.0)


def examine_start(file: CableFile, robot: CableRobot, clearance: Clearance, said: str) -> Start:
    """The start that was asked for, examined: "mean" of the frame anchors, "best" of a grid, or x,y,z or
    x,y,z,rx,ry,rz. Raises ModelError where it cannot be held, where it is singular, and where something touches, with a
    start that would do."""
    if said == "best":
        pose = propose(robot, clearance)
        if pose is None:
            raise ModelError(_none(), key="--start", found=said, expected="other tension limits, or another start")
    else:
        pose = robot.home if said == "mean" else pose_of(file, robot, said)
    lost = ~np.isfinite(structure_of(robot, pose[None], strict=False)[0]).all(axis=0)
    if lost.any():
        message = no_direction(robot.cables[int(np.argmax(lost))], "the start X_0")
        raise ModelError(message, key="--start", found=_pose_text(file, pose))
    found = examine(robot, pose, clearance)
    if found.feasible and not found.touching and found.margin != 0.0:
        return found
    shown = _pose_text(file, pose) + (", the mean of the frame anchors" if said == "mean" else "")
    # Margins are exactly zero at singular poses alone; any motion leaves what is held there.
    why = "the start X_0 is a singular pose: the cables balance the weight there, and no disturbance beside it"
    if not found.feasible:
        lacking = missing_text(robot, found.missing)
        why = f"the start X_0 cannot be held within the tension limits; {lacking} is missing"
    elif found.touching:
        why = f"at the start X_0 {found.touching}"
    other = propose(robot, clearance)
    instead = _none() if other is None else f"such as --start {_pose_text(file, other)} (or --start best)"
    raise ModelError(why, key="--start", found=shown, expected=f"another{';' if other is None else ','} {instead}")


def _none() -> str:
    return f"none of {CELLS} cells along each direction bears a disturbance and is free of contact"


def pose_of(file: CableFile, robot: CableRobot, said: str, key: str = "--start") -> Array:
    """A pose (4, 4) from X,Y,Z or X,Y,Z,RX,RY,RZ in the units of the file, as the option `key` says it. Raises ModelError."""
    many = said.count(",") + 1
    if many not in (3, 6):
        words = "mean, best, " if key == "--start" else ""
        raise ModelError("not a pose", key=key, found=said, expected=f"{words}X,Y,Z or X,Y,Z,RX,RY,RZ")
    values = np.zeros(6)
    units = ([file.units.length] * 3 + [file.units.angle] * 3)[:many]
    values[:many] = in_si(said, "X,Y,Z" if many == 3 else "X,Y,Z,RX,RY,RZ", units, key=key)
    if any(values[i] != 0 and i not in robot.axes for i in range(3, 6)):
        message = f"a robot with {robot.degrees} does not turn so"
        raise ModelError(message, key=key, found=said, expected="X,Y,Z, or 0 there")
    return np.asarray(se3.from_vector(values[None])[0])


def _pose_text(file: CableFile, pose: Array) -> str:
    """A pose as --start takes it."""
    values = se3.to_vector(pose[None])[0]
    shown = [*file.units.length.from_si(values[:3]), *file.units.angle.from_si(values[3:])]
    return ",".join(f"{v:.6g}" for v in (shown if np.abs(values[3:]).max() > 0 else shown[:3]))


def body_of(file: CableFile, robot: CableRobot, said: str) -> Body | None:
    """The platform's body: "hull" or "box" of its anchors, "none", or edges LX,LY,LZ of a box about its origin."""
    if said == "none":
        return None
    if said == "hull":
        return hull(robot.b)
    if said == "box":
        return box(0.5 * np.ptp(robot.b, axis=0), 0.5 * (robot.b.min(axis=0) + robot.b.max(axis=0)))
    if "," not in said:
        raise ModelError("not a body", key="--body", found=said, expected="hull, box, none or LX,LY,LZ")
    edges = in_si(said, "LX,LY,LZ", [file.units.length] * 3, key="--body")
    return box(0.5 * edges)


def clearance_of(
    file: CableFile, robot: CableRobot, diameter: float | None, body: str, relief: float | None
) -> tuple[Clearance, tuple[Remark, ...]]:
    """What the search for contacts is told; without a diameter cables are lines, which is said."""
    said: tuple[Remark, ...] = ()
    wide = robot.diameter
    if diameter is not None or wide is None:
        wide = np.full(len(robot.cables), diameter or 0.0)
        said = (Remark.of(Code.NO_DIAMETER),) if diameter is None else ()
    return Clearance(wide, body_of(file, robot, body), relief), said


def box_of(robot: CableRobot, start: Array, said: Any, si: Any) -> PoseBox:
    """The box Z, from the options of the verb as they were said and in SI: `scale` times that in which the frame can hold its platform
    (`room.frame_box`), not below its bottom, wherever the start is; or X0,Y0,Z0,X1,Y1,Z1. Turns up to `turn` about each axis (30
    degrees when nobody says)."""
    angle, found = TURN if si.turn is None else si.turn, said.box
    if si.turn and max(robot.axes) < 3:
        expected = f"no turn: it is {robot.degrees}"
        raise ModelError("this robot does not turn", key="--turn", found=said.turn, expected=expected)
    if found is not None and said.departs("scale"):
        raise ModelError("a given box is not scaled", key="--scale", found=said.scale, expected="--box or --scale")
    if not 0 <= angle <= math.pi:
        raise ModelError("out of range", key="--turn", found=said.turn, expected="0 to half a turn about each axis")
    if si.box is None:
        sides = _about_frame(robot, si.scale, angle)
        return PoseBox(0.5 * np.ptp(sides, axis=1), np.full(3, angle), sides.mean(axis=1) - start[:3, 3])
    low, high = si.box.reshape(2, 3)
    if np.abs(si.box).max() > BOX_LARGEST * np.abs(robot.a).max():
        expected = f"less than {BOX_LARGEST:g} times the machine"
        raise ModelError("out of range", key="--box", found=found, expected=expected)
    if (low > high).any():
        expected = "X0,Y0,Z0,X1,Y1,Z1 with X0 <= X1, Y0 <= Y1, Z0 <= Z1"
        raise ModelError("an empty box", key="--box", found=found, expected=expected)
    return PoseBox(0.5 * (high - low), np.full(3, angle), 0.5 * (low + high) - start[:3, 3])


def _about_frame(robot: CableRobot, scale: float, angle: float) -> Array:
    """The box (3, 2) m: of every corner of the turns, so that no platform anchor comes below the floor."""
    turns = np.zeros((9, 3))
    turns[1:] = np.array(np.meshgrid(*[[-angle, angle]] * 3)).reshape(3, -1).T
    turns[:, [i for i in range(3) if i + 3 not in robot.axes]] = 0.0
    sides, _ = frame_box(robot, so3.exp(turns))
    middle, half = sides.mean(axis=1), scale * 0.5 * np.ptp(sides, axis=1)
    out = np.stack([middle - half, middle + half], axis=1)
    if 2 in robot.axes:
        out[2, 0] = max(out[2, 0], sides[2, 0])
    return out
