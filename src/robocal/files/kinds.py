"""How each kind of measurement is read from columns: one reader per kind, kept in `READERS`.

A new kind of data is a model (its keys in data.yaml), a function from columns to values in SI, and one line at the end.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from robocal.files import orientation
from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import DataModel, OrientationModel, SigmaModel, ValueModel
from robocal.files.units import UNITS, Unit, parse_unit
from robocal.files.yamlio import Document, Path_
from robocal.geometry import so3

__all__ = ["READERS", "KindReader", "Values", "column_units"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Values:
    """One kind's numbers in SI: value (k, d), sigma (k, d) or None; the unit of lengths and angles in the file, for
    frames and reports."""

    value: Array
    sigma: Array | None
    length: Unit | None = None
    angle: Unit | None = None
    extra: Mapping[str, Array] = field(default_factory=dict)
    options: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class KindReader:
    """A kind of measurement: the model of its data.yaml, its reader, and which parts of a target it can see."""

    name: str
    model: type[DataModel]
    read: Callable[[Any, CsvTable, Document], Values]
    sees: tuple[bool, ...] = (True,) * 6


def column_units(
    table: CsvTable,
    columns: Sequence[str | int],
    stated: str | Sequence[str] | None,
    si: Sequence[str],
    document: Document,
    at: Path_,
) -> list[Unit]:
    """The unit of every column, from its header or as stated; `si` is the quantity of each. Raises FormatError when
    it is missing or said twice and differently.
    """
    out = []
    for i, column in enumerate(columns):
        index = table.find(column)
        label, header = table.label(index), table.units[index]
        said = stated if stated is None or isinstance(stated, str) else stated[i]
        if header is None and said is None:
            # A direction cosine or a part of a quaternion has none.
            if si[i] == "1":
                out.append(parse_unit("1"))
                continue
            word = {"m": "mm", "rad": "deg"}.get(si[i], "K")
            hint = f"`unit` in the data file, or a header such as {label} [{word}]"
            if not document.text:
                raise table.fail("the unit is missing", None, label, expected=f"a header such as {label} [{word}]")
            document.fail("the unit is missing", (*at, "unit"), column=label, expected=hint)
        found = (
            None
            if said is None
            else parse_unit(said, si[i], file=document.path, row=document.row((*at, "unit")), key=f"{at[0]}.unit")
        )
        if header is not None:
            named = parse_unit(header, si[i], file=table.path, column=label)
            if found is not None and found != named:
                raise table.fail(
                    "the header states another unit than the data file", None, label, found=header, expected=found.name
                )
            found = named
        assert found is not None
        out.append(found)
    return out


def _sigmas(
    model: ValueModel, table: CsvTable, units: Sequence[Unit], si: str, document: Document, at: Path_
) -> Array | None:
    """Standard deviations (k, 3) in SI: a number, one column for all, or one column each; None when not stated."""
    if model.sigma is None:
        return None
    if not isinstance(model.sigma, SigmaModel):
        return np.full((len(table), 3), model.sigma * units[0].factor)
    columns = model.sigma.columns
    if len(columns) not in (1, 3):
        document.fail("wrong number of columns", (*at, "sigma", "columns"), found=len(columns), expected="1 or 3")
    numbers = table.numbers(columns)
    bad = np.argwhere(numbers <= 0)
    if len(bad):
        row, i = (int(v) for v in bad[0])
        column = table.label(table.find(columns[i]))
        raise table.fail(
            "a standard deviation must be above 0",
            row,
            column,
            found=float(numbers[row, i]),
            expected="a number above 0",
        )
    stated = [table.unit(c) for c in columns]
    factors = [u.factor if s is None else parse_unit(s, si, file=table.path, column=str(c)).factor
               for u, s, c in zip(units, stated, columns, strict=False)]  # fmt: skip
    return np.broadcast_to(numbers * np.array(factors), (len(table), 3)).copy()


# --- position ---------------------------------------------------------------------------------------------------------------


class PositionModel(DataModel):
    """Positions; an orientation that is stated as well is left aside (a 3x4 matrix may hold the position)."""

    position: ValueModel | None = None
    orientation: OrientationModel | None = None


TRANSLATION = {12: (3, 7, 11), 16: (3, 7, 11)}
ROTATION = {9: tuple(range(9)), 12: (0, 1, 2, 4, 5, 6, 8, 9, 10), 16: (0, 1, 2, 4, 5, 6, 8, 9, 10)}


def _matrix_columns(model: OrientationModel, table: CsvTable) -> list[str | int]:
    """The columns of an orientation; one name that is no column is the prefix of NAME_00, NAME_01, ..."""
    columns = list(model.columns or ())
    if model.form == "matrix" and len(columns) == 1 and isinstance(columns[0], str) and columns[0] not in table.names:
        prefix = columns[0]
        width = 4 if f"{prefix}_03" in table.names else 3
        return [f"{prefix}_{i}{j}" for i in range(3) for j in range(width)]
    return columns


def _position(model: PositionModel, table: CsvTable, document: Document) -> tuple[Array, Array | None, Unit]:
    value = model.position or ValueModel()
    at: Path_ = ("position",)
    columns = value.columns
    if columns is None:
        matrix = _matrix_columns(model.orientation, table) if model.orientation else []
        if len(matrix) not in TRANSLATION:
            document.fail("no columns for the position", at, expected="position: {columns: [x, y, z], unit: mm}")
        columns = [matrix[i] for i in TRANSLATION[len(matrix)]]
    if len(columns) != 3:
        document.fail("wrong number of columns", (*at, "columns"), found=len(columns), expected="3: x, y, z")
    units = column_units(table, columns, value.unit, ("m",) * 3, document, at)
    numbers = table.numbers(columns) * np.array([u.factor for u in units])
    return numbers, _sigmas(value, table, units, "m", document, at), units[0]


def read_position(model: PositionModel, table: CsvTable, document: Document) -> Values:
    """Positions (k, 3) in m."""
    value, sigma, unit = _position(model, table, document)
    return Values(value, sigma, length=unit)


# --- pose -------------------------------------------------------------------------------------------------------------------


class PoseModel(PositionModel):
    """Poses T_measuring_measured: a position and an orientation, or both in one matrix."""

    orientation: OrientationModel


def _rotations(model: OrientationModel, table: CsvTable, document: Document) -> tuple[Array, Array, Unit | None]:
    """R (k, 3, 3); E (k, 3, 3) that takes standard deviations of the file's angles to small rotations; the angles'
    unit."""
    columns = _matrix_columns(model, table)
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
        if model.form == "rotation_vector":
            return so3.exp(angles), plain, units[0]
        for word in ("order", "frame"):
            if getattr(model, word) is None:
                document.fail(
                    "a key is missing",
                    (*at, word),
                    expected="XYZ, ZYX, ..." if word == "order" else "intrinsic or extrinsic",
                )
        intrinsic = model.frame == "intrinsic"
        return (
            orientation.euler(angles, model.order, intrinsic=intrinsic),
            orientation.euler_axes(angles, model.order, intrinsic=intrinsic),
            units[0],
        )
    numbers = table.numbers(columns)
    unit = (
        None
        if model.unit in (None, "1")
        else parse_unit(model.unit, "rad", file=document.path, row=document.row(at), key="orientation.unit")
    )
    if model.form == "matrix":
        return _from_matrix(numbers, table, columns), plain, unit
    q = numbers if model.form == "quaternion_xyzw" else numbers[:, [1, 2, 3, 0]]
    norm = np.linalg.norm(q, axis=1)
    _all(np.abs(norm - 1) < 2e-2, table, columns, "not a unit quaternion", norm, "a length of 1")
    return orientation.quaternion(q / norm[:, None]), plain, unit


def _from_matrix(numbers: Array, table: CsvTable, columns: Sequence[str | int]) -> Array:
    r = numbers[:, ROTATION[numbers.shape[1]]].reshape(-1, 3, 3)
    defect = np.abs(r @ np.swapaxes(r, 1, 2) - np.eye(3)).max(axis=(1, 2))
    _all(
        defect < 2e-2,
        table,
        columns,
        "not a rotation matrix",
        defect,
        "orthogonal rows of length 1, written row by row",
    )
    determinant = np.linalg.det(r)
    _all(determinant > 0, table, columns, "a reflection, not a rotation", determinant, "a determinant of +1")
    if numbers.shape[1] == 16:
        defect = np.abs(numbers[:, 12:] - [0, 0, 0, 1]).max(axis=1)
        _all(defect < 1e-6, table, columns[12:], "not the last row of a pose", defect, "0, 0, 0, 1")
    return so3.project(r)


def _all(
    good: NDArray[np.bool_], table: CsvTable, columns: Sequence[str | int], message: str, value: Array, expected: str
) -> None:
    if not good.all():
        row = int(np.flatnonzero(~good)[0])
        raise table.fail(message, row, table.label(table.find(columns[0])), found=float(value[row]), expected=expected)


def read_pose(model: PoseModel, table: CsvTable, document: Document) -> Values:
    """Frame vectors (k, 6) in m and rad; sigma of the rotation about the instrument's axes."""
    place, sigma, length = _position(model, table, document)
    r, axes, angle = _rotations(model.orientation, table, document)
    given = model.orientation.sigma
    both = None
    if (sigma is None) != (given is None):
        missing = "position" if sigma is None else "orientation"
        document.fail(
            "only one of two standard deviations is stated",
            (missing, "sigma"),
            expected="both, or neither (then estimated)",
        )
    if sigma is not None:
        turn = _sigmas(model.orientation, table, [angle or UNITS["rad"]] * 3, "rad", document, ("orientation",))
        if angle is None and not isinstance(given, SigmaModel):
            document.fail(
                "the unit is missing", ("orientation", "unit"), expected="deg, rad, ... in which sigma is stated"
            )
        assert turn is not None
        if isinstance(given, SigmaModel) and len(given.columns) == 3:
            # Independent errors of the file's angles, carried to the axes about which they turn.
            turn = np.sqrt((axes**2 @ (turn**2)[..., None])[..., 0])
        both = np.hstack([sigma, turn])
    return Values(np.hstack([place, so3.log(r)]), both, length, angle)


READERS: dict[str, KindReader] = {
    reader.name: reader
    for reader in (
        KindReader("position", PositionModel, cast(Any, read_position), (True, True, True, False, False, False)),
        KindReader("pose", PoseModel, cast(Any, read_pose)),
    )
}
