"""Positions: three columns, or the translation of a matrix."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import DataModel, OrientationModel, ValueModel
from robocal.files.kinds.base import Values, column_units, sigmas
from robocal.files.units import Unit
from robocal.files.yamlio import Document, Path_

__all__ = ["PositionModel", "matrix_columns", "position", "read_position"]

Array = NDArray[np.float64]


class PositionModel(DataModel):
    """Positions; an orientation that is stated as well is left aside (a 3x4 matrix may hold the position)."""

    position: ValueModel | None = None
    orientation: OrientationModel | None = None


TRANSLATION = {12: (3, 7, 11), 16: (3, 7, 11)}


def matrix_columns(model: OrientationModel, table: CsvTable) -> list[str | int]:
    """The columns of an orientation; one name that is no column is the prefix of NAME_00, NAME_01, ..."""
    columns = list(model.columns or ())
    if model.form == "matrix" and len(columns) == 1 and isinstance(columns[0], str) and columns[0] not in table.names:
        prefix = columns[0]
        width = 4 if f"{prefix}_03" in table.names else 3
        return [f"{prefix}_{i}{j}" for i in range(3) for j in range(width)]
    return columns


def position(model: PositionModel, table: CsvTable, document: Document) -> tuple[Array, Array | None, Unit]:
    value = model.position or ValueModel()
    at: Path_ = ("position",)
    columns = value.columns
    if columns is None:
        matrix = matrix_columns(model.orientation, table) if model.orientation else []
        if len(matrix) not in TRANSLATION:
            document.fail("no columns for the position", at, expected="position: {columns: [x, y, z], unit: mm}")
        columns = [matrix[i] for i in TRANSLATION[len(matrix)]]
    if len(columns) != 3:
        document.fail("wrong number of columns", (*at, "columns"), found=len(columns), expected="3: x, y, z")
    units = column_units(table, columns, value.unit, ("m",) * 3, document, at)
    numbers = table.numbers(columns) * np.array([u.factor for u in units])
    return numbers, sigmas(value, table, units, "m", document, at), units[0]


def read_position(model: PositionModel, table: CsvTable, document: Document) -> Values:
    """Positions (k, 3) in m."""
    value, sigma, unit = position(model, table, document)
    return Values(value, sigma, length=unit)
