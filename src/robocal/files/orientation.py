"""Orientations as files write them, to rotations and back: matrix, quaternion, rotation vector, Euler angles,
roll-pitch-yaw.

Euler angles of order ABC: intrinsic R = R_A(a) R_B(b) R_C(c), each turn about the axes as turned so far; extrinsic
R = R_C(c) R_B(b) R_A(a), each about the fixed axes. Roll-pitch-yaw is extrinsic XYZ.

Frames in files are xyz with a rotation vector or roll-pitch-yaw.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robocal import _scipy as scipy
from robocal._types import Array
from robocal.files.robot_rows import MOST_TURN
from robocal.files.schema import FrameModel
from robocal.files.units import Units, number
from robocal.files.yamlio import Path_, YamlDocument
from robocal.geometry import so3

__all__ = [
    "FORMS",
    "euler",
    "euler_axes",
    "frame_changes",
    "frame_vector",
    "quaternion",
    "refuse_turns",
    "rpy",
    "to_form",
]

# Form: how many numbers it takes. A matrix may be 3x3, 3x4 or 4x4, row by row.
FORMS = {
    "matrix": (9, 12, 16),
    "quaternion_xyzw": (4,),
    "quaternion_wxyz": (4,),
    "rotation_vector": (3,),
    "euler": (3,),
}


def _turns(angles: Array, order: str) -> tuple[list[Array], list[Array]]:
    """Unit axes and rotations (..., 3, 3) of each angle (..., 3)."""
    axes = [np.eye(3)["XYZ".index(letter)] for letter in order.upper()]
    return axes, [so3.exp(angles[..., i, None] * axis) for i, axis in enumerate(axes)]


def euler(angles: ArrayLike, order: str = "XYZ", *, intrinsic: bool = True) -> Array:
    """R (..., 3, 3) of Euler angles (..., 3) in rad."""
    _, (a, b, c) = _turns(np.asarray(angles, float), order)
    return a @ b @ c if intrinsic else c @ b @ a


def euler_axes(angles: ArrayLike, order: str = "XYZ", *, intrinsic: bool = True) -> Array:
    """E (..., 3, 3) with dw = E dangles: the small rotation about the outer axes that a change of each angle makes."""
    angles = np.asarray(angles, float)
    (a, b, c), (ra, rb, rc) = _turns(angles, order)
    shape = angles.shape
    if intrinsic:
        parts = (np.broadcast_to(a, shape), ra @ b, ra @ rb @ c)
    else:
        parts = (rc @ rb @ a, rc @ b, np.broadcast_to(c, shape))
    return np.stack(parts, axis=-1)


def quaternion(xyzw: ArrayLike) -> Array:
    """R (..., 3, 3) of unit quaternions (..., 4), scalar last."""
    x, y, z, w = np.moveaxis(np.asarray(xyzw, float), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def rpy(angles: ArrayLike) -> Array:
    """R of roll, pitch, yaw: R_z(yaw) R_y(pitch) R_x(roll)."""
    return euler(angles, "XYZ", intrinsic=False)


def to_form(rotation: ArrayLike, form: str, order: str = "XYZ", *, intrinsic: bool = True) -> Array:
    """The numbers (k, w) of rotations (k, 3, 3) in a form of `FORMS`, rows of a matrix one after the other, angles in
    rad; where Euler angles are not unique the last one is zero."""
    r = np.asarray(rotation, float).reshape(-1, 3, 3)
    if form == "matrix":
        return r.reshape(-1, 9)
    if form == "rotation_vector":
        return so3.log(r)
    turned = scipy.spatial.transform.Rotation.from_matrix(r)
    if form == "euler":
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # the poles, see above
            return np.asarray(turned.as_euler(order.upper() if intrinsic else order.lower()))
    xyzw = np.asarray(turned.as_quat())
    return xyzw if form == "quaternion_xyzw" else xyzw[:, [3, 0, 1, 2]]


def frame_vector(model: FrameModel | None, units: Units) -> tuple[float, ...]:
    """x, y, z in m and a rotation vector in rad; zeros for what is not stated."""
    if model is None:
        return (0.0,) * 6
    xyz = units.length.to_si(np.array(model.xyz or (0.0,) * 3))
    turn = units.angle.to_si(np.array(model.rotation_vector or (0.0,) * 3))
    if model.rpy is not None:
        turn = so3.log(rpy(units.angle.to_si(np.array(model.rpy))))
    return tuple(float(v) for v in (*xyz, *turn))


def refuse_turns(document: YamlDocument, model: FrameModel, units: Units, path: Path_) -> None:
    """Raises FormatError for a rotation vector that is longer than a whole turn: one of another unit."""
    size = float(np.linalg.norm(units.angle.to_si(np.array(model.rotation_vector or (0.0,) * 3))))
    if size > MOST_TURN:
        found = f"a turn of {np.degrees(size):.4g} deg, as {units.angle.name} are read"
        expected = f"at most {units.angle.from_si(2 * np.pi):.4g} {units.angle.name}: look at units.angle"
        document.fail("more than a whole turn", (*path, "rotation_vector"), found=found, expected=expected)


def frame_changes(data: Mapping[str, Any], owner: str, vector: Array, units: Units) -> dict[Path_, float | str]:
    """What to write so that frame `owner` of a document says `vector` (6,) in SI, in the words in which it is
    written."""
    given = data.get(owner)
    word = "rpy" if isinstance(given, dict) and given.get("rpy") is not None else "rotation_vector"
    turn = so3.roll_pitch_yaw(so3.exp(vector[3:])) if word == "rpy" else vector[3:]
    parts = {"xyz": units.length.from_si(vector[:3]), word: units.angle.from_si(turn)}
    shown = {name: f"[{', '.join(number(float(v)) for v in values)}]" for name, values in parts.items()}
    if not isinstance(given, dict):
        return {(owner,): "{" + ", ".join(f"{k}: {v}" for k, v in shown.items()) + "}"}
    out: dict[Path_, float | str] = {}
    for name, values in parts.items():
        if given.get(name) is None:
            out[(owner, name)] = shown[name]
        else:
            out.update({(owner, name, i): float(v) for i, v in enumerate(values) if given[name][i] != v})
    return out
