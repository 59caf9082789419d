"""Poses: a position with an orientation in any of the usual forms."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.files import orientation
from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import OrientationModel, SigmaModel
from robocal.files.kinds.kind import (
    KindFile,
    KindOutput,
    Values,
    column_units,
    columns,
    refuse_one_sigma,
    section,
    sigmas,
)
from robocal.files.kinds.position import XYZ, XYZ_SIGMA, PositionModel, matrix_columns, position
from robocal.files.units import UNITS, Unit, Units
from robocal.files.yamlio import Path_, YamlDocument
from robocal.geometry import so3
from robocal.measure.data import Observations

__all__ = ["POSE", "PoseModel", "read_pose", "write_pose"]

TURN = ("rx", "ry", "rz")
TURN_SIGMA = ("srx", "sry", "srz")
ROTATION = {9: tuple(range(9)), 12: (0, 1, 2, 4, 5, 6, 8, 9, 10), 16: (0, 1, 2, 4, 5, 6, 8, 9, 10)}


class PoseModel(PositionModel):
    """Poses T_measuring_measured: a position and an orientation, or both in one matrix."""

    orientation: OrientationModel


def _rotations(model: OrientationModel, table: CsvTable, document: YamlDocument) -> tuple[Array, Array, Unit | None]:
    """R (k, 3, 3); E (k, 3, 3) that takes standard deviations of the file's angles to small rotations; the angles'
    unit."""
    columns = matrix_columns(model, table)
    at: Path_ = ("orientation",)
    sizes = orientation.FORMS[model.form]
    if len(columns) not in sizes:
        expected = " or ".join(str(s) for s in sizes) + f" for {model.form}"
        document.fail("wrong number of columns", (*at, "columns"), found=len(columns), expected=expected)
    angular = model.form in ("rotation_vector", "euler")
    plain = np.broadcast_to(np.eye(3), (len(table), 3, 3))
    if angular:
        units = column_units(table, columns, model.unit, ("rad",) * 3, document, at)
        angles = table.numbers(columns) * np.array([u.factor for u in units])
        most = float(np.median(np.abs(angles).max(axis=1, initial=0.0))) if len(angles) else 0.0
        if most > 2 * np.pi:
            document.fail(
                "orientations of more than a whole turn", (*at, "unit"),
                expected=", ".join(f"{table.label(table.find(c))} [deg]" for c in columns) + " in the header, or unit: deg",
                found=f"{units[0].name}: {most / np.pi * 180:.3g} deg in the median",
            )  # fmt: skip
        if model.form == "rotation_vector":
            return so3.exp(angles), plain, units[0]
        for word, expected in (("order", "XYZ, ZYX, ..."), ("frame", "intrinsic or extrinsic")):
            if getattr(model, word) is None:
                document.fail("a key is missing", (*at, word), expected=expected)
        order, intrinsic = model.order, model.frame == "intrinsic"
        axes = orientation.euler_axes(angles, order, intrinsic=intrinsic)
        return orientation.euler(angles, order, intrinsic=intrinsic), axes, units[0]
    numbers = table.numbers(columns)
    unit = None if model.unit in (None, "1") else document.unit(model.unit, "rad", at, "orientation.unit")
    if model.form == "matrix":
        return _from_matrix(numbers, table, columns), plain, unit
    q = numbers if model.form == "quaternion_xyzw" else numbers[:, [1, 2, 3, 0]]
    norm = np.linalg.norm(q, axis=1)
    table.insist(np.abs(norm - 1) < 2e-2, columns, "not a unit quaternion", norm, expected="a length of 1")
    return orientation.quaternion(q / norm[:, None]), plain, unit


def _from_matrix(numbers: Array, table: CsvTable, columns: Sequence[str | int]) -> Array:
    r = numbers[:, ROTATION[numbers.shape[1]]].reshape(-1, 3, 3)
    defect = np.abs(r @ np.swapaxes(r, 1, 2) - np.eye(3)).max(axis=(1, 2))
    expected = "orthogonal rows of length 1, written row by row"
    table.insist(defect < 2e-2, columns, "not a rotation matrix", defect, expected=expected)
    determinant = np.linalg.det(r)
    table.insist(determinant > 0, columns, "a reflection, not a rotation", determinant, expected="a determinant of +1")
    if numbers.shape[1] == 16:
        defect = np.abs(numbers[:, 12:] - [0, 0, 0, 1]).max(axis=1)
        table.insist(defect < 1e-6, columns[12:], "not the last row of a pose", defect, expected="0, 0, 0, 1")
    return so3.project(r)


def read_pose(model: Any, table: CsvTable, document: YamlDocument) -> Values:
    """Frame vectors (k, 6) in m and rad; sigma of the rotation about the instrument's axes."""
    place, sigma, length, digits = position(model, table, document)
    r, axes, angle = _rotations(model.orientation, table, document)
    given = model.orientation.sigma
    both = None
    if (sigma is None) != (given is None):
        refuse_one_sigma("position" if sigma is None else "orientation", document)
    if sigma is not None:
        turn = sigmas(model.orientation, table, [angle or UNITS["rad"]] * 3, "rad", document, ("orientation",))
        if angle is None and not isinstance(given, SigmaModel):
            expected = "deg, rad, ... in which sigma is stated"
            document.fail("the unit is missing", ("orientation", "unit"), expected=expected)
        assert turn is not None
        if isinstance(given, SigmaModel) and len(given.columns) == 3:
            # Independent errors of the file's angles, carried to the axes about which they turn.
            turn = np.sqrt((axes**2 @ (turn**2)[..., None])[..., 0])
        both = np.hstack([sigma, turn])
    # What rounding does to a rotation depends on its form; it is left out.
    written = np.hstack([digits, np.zeros_like(digits)])
    return Values(np.hstack([place, so3.log(r)]), both, length, angle, digits=written)


def write_pose(obs: Observations, units: Units) -> KindOutput:
    """Position and rotation vector, and their sigmas."""
    made = columns((*XYZ, *TURN), (*XYZ_SIGMA, *TURN_SIGMA), [units.length] * 3 + [units.angle] * 3, obs)
    turn = section("orientation", TURN, TURN_SIGMA, obs, ", form: rotation_vector")
    return KindOutput(made, (section("position", XYZ, XYZ_SIGMA, obs), turn))


POSE_KEYS = """position: {{columns: [x, y, z], unit: {length}, sigma: 0.02}}    # or {{columns: [sx, sy, sz]}}, or leave it out
orientation: {{columns: [rx, ry, rz], form: rotation_vector, unit: {angle}, sigma: 0.005}}
#   form: or matrix, quaternion_xyzw, quaternion_wxyz, euler with order: XYZ, frame: intrinsic
frame: {{name: tracker, free: true}}    # where the instrument stands is found from the data
"""
POSE = KindFile("pose", PoseModel, read_pose, write_pose, POSE_KEYS, located=True, lengths="position")
