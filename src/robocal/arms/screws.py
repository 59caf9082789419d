"""Conventions that place a joint axis by direction and point: zero reference, POE, local POE, CPC, six offsets, URDF.

The nominal axis stays constant; its error is written in a minimal local chart that is zero at the nominal axis and
never singular:

    exp(xi q)  ->  E exp(xi q) E^-1,    E = exp(tilt_u) exp(tilt_v) exp(shift_u) exp(shift_v)

tilt_u, tilt_v turn the axis w about two directions u, v perpendicular to it (u x v = w) through its point; shift_u,
shift_v move it along them. That is 4 numbers for a revolute joint and 2 (the tilts) for a prismatic one: 4R + 2P, and
6 for the tool. u is the projection of the coordinate axis that follows the largest component of w in x, y, z, x, ...,
so an axis along z has u = x, v = y. `offset` is the joint's zero error; the chart and the tool can say the same, so
it is held fixed unless named. Sources: Mooring, The effect of joint axis misalignment on robot positioning accuracy
(1983), for the zero reference; Brockett, Robotic manipulators and the product of exponentials formula (1984); Chen,
Yang, Tan and Yeo, Local POE model for robot kinematic calibration (2001); Zhuang, Roth and Hamano, A complete and
parametrically continuous kinematic model for robot manipulators (1992).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from robocal._types import Array
from robocal.arms.row_builder import Convention, Key, Row, RowBuilder
from robocal.errors import ModelError
from robocal.geometry import so3

__all__ = ["SCREW_CONVENTIONS", "chart"]

ZERO = np.zeros(3)
POINT = (0.0, 0.0, 0.0)
OFFSET = Key("offset", "drive", 0.0, "zero error of the joint; held unless named")
CHART = (
    Key("tilt_u", "angle", 0.0, "turn of the axis about u through its point"),
    Key("tilt_v", "angle", 0.0, "turn of the axis about v through its point"),
    Key("shift_u", "length", 0.0, "shift of the axis along u (revolute only)"),
    Key("shift_v", "length", 0.0, "shift of the axis along v (revolute only)"),
)
FRAME = (
    Key("x", "length", 0.0, "place of the joint's frame in the one before"),
    Key("y", "length"),
    Key("z", "length"),
    Key("rx", "angle", 0.0, "its turn, a rotation vector"),
    Key("ry", "angle"),
    Key("rz", "angle"),
)


def chart(axis: Array) -> tuple[Array, Array]:
    """The directions u, v with u x v = axis (3,), a unit vector: u is the projection of the coordinate axis after its
    largest component."""
    k = (int(np.argmax(np.abs(axis))) + 1) % 3
    u = np.eye(3)[k] - axis[k] * axis
    u /= np.linalg.norm(u)
    return u, np.cross(axis, u)


def line(direction: Array, point: Array) -> Array:
    """The screw (v, w) (6,) of a turn about a line: w = direction, v = point x direction."""
    return np.concatenate([np.cross(point, direction), direction])


def _deviating(pen: RowBuilder, screw: Array, axis: Array, point: Array) -> None:
    """E exp(screw (q + offset)) E^-1."""
    u, v = chart(axis)
    moves = [("tilt_u", line(u, point), "rad"), ("tilt_v", line(v, point), "rad")]
    if pen.kind == "revolute":
        moves += [("shift_u", np.concatenate([u, ZERO]), "m"), ("shift_v", np.concatenate([v, ZERO]), "m")]
    for symbol, along, unit in moves:
        pen.step("screw", symbol, pen.number(symbol), along, unit=unit)
    pen.drive("screw", screw)
    for symbol, along, _ in reversed(moves):
        pen.undo(symbol, along)


def _no_fixed(pen: RowBuilder, word: str) -> None:
    if pen.kind == "fixed":
        expected = "revolute, prismatic"
        raise ModelError(f"{word} knows no fixed rows", key=f"{pen.joint}.type", found="fixed", expected=expected)


def _zero_reference(pen: RowBuilder) -> None:
    _no_fixed(pen, "zero-reference")
    axis, point = pen.unit("axis"), pen.vector("point")
    screw = line(axis, point) if pen.kind == "revolute" else np.concatenate([axis, ZERO])
    _deviating(pen, screw, axis, point)


def _poe(pen: RowBuilder) -> None:
    _no_fixed(pen, "poe")
    v, w = pen.vector("v"), pen.vector("w")
    turning = pen.kind == "revolute"
    axis, length = (w, math.hypot(*w)) if turning else (v, math.hypot(*v))
    # v is stated for a unit w, so a w of another length leaves open which of the two was meant.
    if abs(length - 1.0) > 1e-6:
        message = "not a unit vector"
        raise ModelError(message, key=f"{pen.joint}.{'w' if turning else 'v'}", found=list(axis), expected="length 1")
    if not turning and w.any():
        raise ModelError("a prismatic joint does not turn", key=f"{pen.joint}.w", found=list(w), expected="0, 0, 0")
    axis = axis / length
    # The point of the axis that is closest to the base's origin.
    point = np.cross(axis, v) if turning else ZERO
    _deviating(pen, np.concatenate([v, axis]) if turning else np.concatenate([axis, ZERO]), axis, point)


def _turn_or_shift(pen: RowBuilder, axis: Array, point: Array = ZERO) -> None:
    """The joint's motion along its axis, as a plain coordinate element where the axis is one and passes through the
    origin."""
    turning = pen.kind == "revolute"
    along = [i for i in range(3) if abs(abs(axis[i]) - 1.0) < 1e-12]
    if along and not (turning and point.any()):
        pen.drive(("r" if turning else "t") + "xyz"[along[0]], sign=math.copysign(1.0, axis[along[0]]))
    else:
        pen.drive("screw", line(axis, point) if turning else np.concatenate([axis, ZERO]))


def _in_own_frame(pen: RowBuilder) -> None:
    """The joint's frame, then its motion about an axis there, through the point that poe-local has of it."""
    pen.frame([pen.number(k.name) for k in FRAME])
    _turn_or_shift(pen, pen.unit("axis"), pen.vector("point") if "point" in pen.keys else ZERO)


def _urdf(pen: RowBuilder) -> None:
    roll, pitch, yaw = pen.vector("rpy")
    turn = so3.exp([0.0, 0.0, yaw]) @ so3.exp([0.0, pitch, 0.0]) @ so3.exp([roll, 0.0, 0.0])
    pen.frame([*pen.vector("xyz"), *so3.log(turn)])
    _turn_or_shift(pen, pen.unit("axis"))


def _read_urdf(row: Row, values: Mapping[str, float]) -> dict[str, object]:
    """Origin as URDF writes it: xyz, and rpy with pitch in [-pi/2, pi/2]."""
    turn = so3.roll_pitch_yaw(so3.exp([values["rx"], values["ry"], values["rz"]]))
    out = {**row, "xyz": [values["x"], values["y"], values["z"]], "rpy": turn.tolist()}
    return out | ({"offset": values["offset"]} if "offset" in values else {})


def _cpc(pen: RowBuilder) -> None:
    """Q_i V_i with V_i = R(b) Rx(tilt_x) Ry(tilt_y) Rz(beta) T(lx, ly, lz); R(b) is the smallest turn that takes z to
    b."""
    if pen.kind != "fixed":
        pen.drive("tz" if pen.kind == "prismatic" else "rz")
    b = pen.unit("b")
    sine = math.hypot(b[0], b[1])
    if b[2] < 0.0 and sine < 1e-9:
        message = "CPC is singular at b = -z: let the next axis point the other way"
        raise ModelError(message, key=f"{pen.joint}.b", found=list(b))
    if sine > 0.0:
        pen.constant("screw", math.atan2(sine, b[2]), [0.0, 0.0, 0.0, -b[1] / sine, b[0] / sine, 0.0])
    for axis, symbol in (("rx", "tilt_x"), ("ry", "tilt_y"), ("rz", "beta"), ("tx", "lx"), ("ty", "ly"), ("tz", "lz")):
        pen.step(axis, symbol, pen.number(symbol))


AXIS_Z = Key("axis", "direction", (0.0, 0.0, 1.0), "direction of the joint axis in its own frame")
_CPC_KEYS = (
    Key("b", "direction", (0.0, 0.0, 1.0), "direction of the next joint axis in this joint's frame"),
    Key("tilt_x", "angle", 0.0, "turn of b about x: the error of b_y"),
    Key("tilt_y", "angle", 0.0, "turn of b about y: the error of b_x"),
    Key("beta", "angle", 0.0, "turn about the next axis"),
    Key("lx", "length", 0.0, "place of the next frame"),
    Key("ly", "length"),
    Key("lz", "length"),
    OFFSET,
)
_E = "E exp(xi (q + offset)) E^-1"
SCREW_CONVENTIONS = (
    Convention(
        "cpc", _CPC_KEYS, _cpc, "offset", "offset", True, "Rz(q) or Tz(q), then R(b) Rx(tilt_x) Ry(tilt_y) Rz(beta) T(lx, ly, lz)",
        "Zhuang, Roth and Hamano (1992)",
    ),
    Convention(
        "zero-reference",
        (
            Key("axis", "direction", None, "direction of the joint axis in the base frame, the arm at zero"),
            Key("point", "point", None, "a point on it; the tilts turn about this point"),
            *CHART,
            OFFSET,
        ),
        _zero_reference, "offset", "offset", True, f"{_E}, xi of axis and point", "Mooring (1983)", home=True,
    ),
    Convention(
        "poe",
        (
            Key("v", "moment", None, "linear part of the unit screw in the base frame, the arm at zero: point x w, or the direction"),
            Key("w", "direction", POINT, "angular part, of length one; zero for a prismatic joint"),
            *CHART,
            OFFSET,
        ),
        _poe, "offset", "offset", True, f"{_E}, xi = (v, w)", "Brockett (1984)", home=True,
    ),
    Convention(
        "poe-local", (*FRAME, AXIS_Z, Key("point", "point", POINT, "a point on the axis, in its own frame"), OFFSET),
        _in_own_frame, "offset", "offset", True, "frame(x ... rz) exp(xi (q + offset))", "Chen, Yang, Tan and Yeo (2001)",
    ),
    Convention(
        "offsets", (*FRAME, AXIS_Z, OFFSET),
        _in_own_frame, "offset", "offset", True, "frame(x ... rz) R or T(axis, q + offset)", "six free numbers per joint",
    ),
    Convention(
        "urdf",
        (
            Key("xyz", "point", POINT, "the joint's origin in its parent's frame; parameters joint.x .y .z"),
            Key("rpy", "angles", POINT, "roll, pitch, yaw about fixed x, y, z; parameters joint.rx .ry .rz, a rotation vector"),
            Key("axis", "direction", (1.0, 0.0, 0.0), "direction of the joint axis in its own frame"),
            OFFSET,
        ),
        _urdf, "offset", "offset", True, "frame(xyz, Rz(yaw) Ry(pitch) Rx(roll)) R or T(axis, q + offset)",
        "URDF, as ROS reads it", read=_read_urdf,
    ),
)  # fmt: skip
