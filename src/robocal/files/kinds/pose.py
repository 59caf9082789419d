"""Positions and poses, of a configuration or of two compared: three columns, and an orientation in any of the usual forms.

relative_pose   T_first_second of the tool, as an inertial unit or visual odometry reports it
displacement    p(second) - p(first) in the axes of an instrument
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.errors import ToWrite
from robocal.files import orientation
from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import (
    DataModel,
    FramedModel,
    OrientationModel,
    PlaceValuesModel,
    SecondModel,
    SigmaModel,
    ValueModel,
)
from robocal.files.kinds.kind import (
    XYZ,
    KindFile,
    KindOutput,
    QuantityColumns,
    Values,
    column_units,
    refuse_one_sigma,
    sigmas,
    unit_rows,
)
from robocal.files.units import UNITS, Unit, Units
from robocal.files.yamlio import YamlDocument, flow
from robocal.geometry import so3
from robocal.measure.data import Observations

__all__ = [
    "DISPLACEMENT",
    "POSE",
    "POSITION",
    "RELATIVE_POSE",
    "PositionModel",
    "matrix_columns",
    "place_columns",
    "read_pose",
    "read_position",
]  # fmt: skip

PLACE = QuantityColumns("position", ("x", "y", "z"), ("sx", "sy", "sz"))
TURN = QuantityColumns("orientation", ("rx", "ry", "rz"), ("srx", "sry", "srz"), "rad")
STEP = QuantityColumns("displacement", ("dx", "dy", "dz"), ("sdx", "sdy", "sdz"))
TRANSLATION = {12: (3, 7, 11), 16: (3, 7, 11)}
ROTATION = {9: tuple(range(9)), 12: (0, 1, 2, 4, 5, 6, 8, 9, 10), 16: (0, 1, 2, 4, 5, 6, 8, 9, 10)}


class PositionModel(FramedModel):
    """Positions; an orientation that is stated as well is left aside (a 3x4 matrix may hold the position)."""

    position: PlaceValuesModel | None = None
    orientation: OrientationModel | None = None


class PoseModel(PositionModel):
    """Poses T_measuring_measured: a position and an orientation, or both in one matrix."""

    orientation: OrientationModel


class RelativePoseModel(DataModel):
    """Poses of the second configuration seen from the first: T_first_second."""

    position: PlaceValuesModel | None = None
    orientation: OrientationModel
    second: SecondModel = SecondModel.model_construct()


class DisplacementModel(FramedModel):
    """How far the target moved, from the first configuration to the second."""

    displacement: ValueModel = ValueModel.model_construct()
    second: SecondModel = SecondModel.model_construct()


def matrix_columns(model: OrientationModel, table: CsvTable) -> list[str | int]:
    """The columns of an orientation; one name that is no column is the prefix of NAME_00, NAME_01, ..."""
    columns = list(model.columns or ())
    if model.form == "matrix" and len(columns) == 1 and isinstance(columns[0], str) and columns[0] not in table.names:
        prefix = columns[0]
        width = 4 if f"{prefix}_03" in table.names else 3
        height = 4 if width == 4 and f"{prefix}_33" in table.names else 3
        return [f"{prefix}_{i}{j}" for i in range(height) for j in range(width)]
    return columns


def place_columns(model: Any, table: CsvTable) -> list[str | int]:
    """The columns of the coordinates, of their own or of the matrix; none where nothing says."""
    if model.position is not None and model.position.columns is not None:
        return list(model.position.columns)
    matrix = matrix_columns(model.orientation, table) if model.orientation else []
    return [matrix[i] for i in TRANSLATION.get(len(matrix), ())]


def read_position(model: Any, table: CsvTable, document: YamlDocument) -> Values:
    """Positions (k, 3) in m."""
    value = model.position or PlaceValuesModel()
    if value.columns is None:
        found, expected = place_columns(model, table), "position: {columns: [x, y, z], unit: mm}"
        if not found:
            document.fail("no columns for the position", (PLACE.key,), expected=expected)
        value = value.model_copy(update={"columns": found})
    for word, given in (("unit", value.unit), ("sign", value.sign)):
        if isinstance(given, list) and len(given) != 3:
            at, expected = (PLACE.key, word), "one for each column, 3"
            document.fail("wrong number of entries", at, found=len(given), expected=expected)
    numbers, sigma, units = PLACE.numbers(value, table, document)
    digits = table.digits(value.columns) * np.array([u.factor for u in units])
    return Values(numbers * np.array(value.sign or 1.0), sigma, units[0], digits=digits)


def _rotations(model: OrientationModel, table: CsvTable, document: YamlDocument) -> tuple[Array, Array, Unit | None]:
    """R (k, 3, 3); E (k, 3, 3) that takes standard deviations of the file's angles to small rotations; the angles'
    unit."""
    columns = matrix_columns(model, table)
    sizes = orientation.FORMS[model.form]
    if len(columns) not in sizes:
        expected = " or ".join(str(s) for s in sizes) + f" for {model.form}"
        document.fail("wrong number of columns", (TURN.key, "columns"), found=len(columns), expected=expected)
    plain = np.broadcast_to(np.eye(3), (len(table), 3, 3))
    if model.form in ("rotation_vector", "euler"):
        units = column_units(table, columns, model.unit, ("rad",) * 3, document, (TURN.key,))
        angles = table.numbers(columns) * np.array([u.factor for u in units])
        most = float(np.median(np.abs(angles).max(axis=1, initial=0.0))) if len(angles) else 0.0
        if most > 2 * np.pi:
            found = f"{units[0].name}: {most / np.pi * 180:.3g} deg in the median"
            headers = ", ".join(f"{table.label(table.find(c))} [deg]" for c in columns)
            expected = f"{headers} in the header, or unit: deg"
            document.fail("orientations of more than a whole turn", (TURN.key, "unit"), expected=expected, found=found)
        if model.form == "rotation_vector":
            return so3.exp(angles), plain, units[0]
        for word, expected in (("order", "XYZ, ZYX, ..."), ("frame", "intrinsic or extrinsic")):
            if getattr(model, word) is None:
                document.fail("a key is missing", (TURN.key, word), expected=expected)
        order, intrinsic = model.order, model.frame == "intrinsic"
        axes = orientation.euler_axes(angles, order, intrinsic=intrinsic)
        return orientation.euler(angles, order, intrinsic=intrinsic), axes, units[0]
    numbers = table.numbers(columns)
    unit = None if model.unit in (None, "1") else document.unit(model.unit, "rad", (TURN.key,), "orientation.unit")
    if model.form == "matrix":
        _refuse_columns_first(numbers, table, columns, document)
        return _from_matrix(numbers, table, columns), plain, unit
    q = numbers if model.form == "quaternion_xyzw" else numbers[:, [1, 2, 3, 0]]
    return orientation.quaternion(unit_rows(q, table, columns, "quaternion")), plain, unit


def _refuse_columns_first(
    numbers: Array, table: CsvTable, columns: Sequence[str | int], document: YamlDocument
) -> None:
    """Raises FormatError where every matrix stands column by column: its rotation is one only then, or its last row has the place."""
    height = numbers.shape[1] // 4
    if height < 3 or not len(numbers):
        return
    order = [height * j + i for i in range(height) for j in range(4)]
    there, ends = numbers[:, order], np.array([0.0, 0.0, 0.0, 1.0])
    turned, read = (np.abs(r @ np.swapaxes(r, 1, 2) - np.eye(3)).max() < 2e-2 for n in (there, numbers)
                    for r in (n[:, ROTATION[n.shape[1]]].reshape(-1, 3, 3),))  # fmt: skip
    by_columns = turned and not read
    if height == 4:
        by_columns = turned and bool(
            (np.abs(there[:, 12:] - ends) < 1e-6).all() and (np.abs(numbers[:, 12:15]) > 1e-6).any()
        )
    if not by_columns:
        return
    names = [table.label(table.find(columns[i])) for i in order]
    unit = {} if table.unit(names[3]) else {"unit": table.unit(columns[3])}
    keys = {"orientation": {"columns": names, "form": "matrix"}} | ({"position": unit} if unit.get("unit") else {})
    line = " and ".join(f"{k}: {flow(v)}" for k, v in keys.items())
    if not document.text:
        line = f"a data.yaml beside it, with the line {flow({k: v for k, v in {**document.data, **keys}.items() if v != {}})}"
    message = "the matrices are written column by column, not row by row"
    raise table.fail(message, column=str(names[0]), expected=ToWrite(line))


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
    place = read_position(model, table, document)
    r, axes, angle = _rotations(model.orientation, table, document)
    sigma, given = place.sigma, model.orientation.sigma
    if (sigma is None) != (given is None):
        refuse_one_sigma("position" if sigma is None else "orientation", document)
    if sigma is not None:
        turn = sigmas(model.orientation, table, [angle or UNITS["rad"]] * 3, "rad", document, TURN.key)
        if angle is None and not isinstance(given, SigmaModel):
            expected = "deg, rad, ... in which sigma is stated"
            document.fail("the unit is missing", (TURN.key, "unit"), expected=expected)
        assert turn is not None
        if isinstance(given, SigmaModel) and len(given.columns) == 3:
            # Independent errors of the file's angles, carried to the axes about which they turn.
            turn = np.sqrt((axes**2 @ (turn**2)[..., None])[..., 0])
        sigma = np.hstack([sigma, turn])
    assert place.digits is not None
    # What rounding does to a rotation depends on its form; it is left out.
    written = np.hstack([place.digits, np.zeros_like(place.digits)])
    return Values(np.hstack([place.value, so3.log(r)]), sigma, place.length, angle, digits=written)


def write_pose(obs: Observations, units: Units) -> KindOutput:
    """Position and rotation vector, then their sigmas."""
    place, turn = PLACE.columns(obs, units), TURN.columns(obs, units, 3)
    made = (*place[:3], *turn[:3], *place[3:], *turn[3:])
    return KindOutput(made, (PLACE.line(obs), TURN.line(obs, "columns: [rx, ry, rz], form: rotation_vector")))


POSITION_KEYS = """position: {{columns: [x, y, z], unit: {length}, sigma: 0.02}}    # or {{columns: [sx, sy, sz]}}, or leave it out
frame: {{name: tracker, free: true}}    # where the instrument stands is found from the data
"""
POSITION = KindFile(PositionModel, read_position, PLACE.write, POSITION_KEYS, XYZ, located=True, lengths="position")
POSE_KEYS = """position: {{columns: [x, y, z], unit: {length}, sigma: 0.02}}    # or {{columns: [sx, sy, sz]}}, or leave it out
orientation: {{columns: [rx, ry, rz], form: rotation_vector, unit: {angle}, sigma: 0.005}}
#   form: or matrix, quaternion_xyzw, quaternion_wxyz, euler with order: XYZ, frame: intrinsic
frame: {{name: tracker, free: true}}    # where the instrument stands is found from the data
"""
POSE = KindFile(PoseModel, read_pose, write_pose, POSE_KEYS, located=True, lengths="position")
RELATIVE_POSE_KEYS = """second: {{columns: [{second}], unit: {joint_unit}}}    # the joints of the other configuration of a row
position: {{columns: [x, y, z], unit: {length}, sigma: 0.05}}    # where it came to, seen from the first
orientation: {{columns: [rx, ry, rz], form: rotation_vector, unit: {angle}, sigma: 0.005}}
# targets: {{imu: {{xyz: [0, 0, 50], free: true}}}}    # the measured thing on the tool; default the tool frame
"""
RELATIVE_POSE = KindFile(RelativePoseModel, read_pose, write_pose, RELATIVE_POSE_KEYS, lengths="position")
DISPLACEMENT_KEYS = """second: {{columns: [{second}], unit: {joint_unit}}}    # the joints of the other configuration of a row
displacement: {{columns: [dx, dy, dz], unit: {length}, sigma: 0.05}}    # second minus first
frame: {{name: camera, free: [rx, ry, rz]}}    # only how the instrument is turned is seen
"""
DISPLACEMENT = KindFile(DisplacementModel, STEP.read, STEP.write, DISPLACEMENT_KEYS, XYZ, lengths="displacement")
