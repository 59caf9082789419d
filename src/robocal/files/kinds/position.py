"""Positions: three columns, or the translation of a matrix."""

from __future__ import annotations

from typing import Any

import numpy as np

from robocal._types import Array
from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import FramedModel, OrientationModel, PlaceValuesModel
from robocal.files.kinds.kind import KindFile, KindOutput, Values, columns, quantity, section
from robocal.files.units import Unit, Units
from robocal.files.yamlio import Path_, YamlDocument
from robocal.measure.data import Observations

__all__ = ["POSITION", "PositionModel", "matrix_columns", "place_columns", "position"]


class PositionModel(FramedModel):
    """Positions; an orientation that is stated as well is left aside (a 3x4 matrix may hold the position)."""

    position: PlaceValuesModel | None = None
    orientation: OrientationModel | None = None


XYZ = ("x", "y", "z")
XYZ_SIGMA = ("sx", "sy", "sz")
TRANSLATION = {12: (3, 7, 11), 16: (3, 7, 11)}


def matrix_columns(model: OrientationModel, table: CsvTable) -> list[str | int]:
    """The columns of an orientation; one name that is no column is the prefix of NAME_00, NAME_01, ..."""
    columns = list(model.columns or ())
    if model.form == "matrix" and len(columns) == 1 and isinstance(columns[0], str) and columns[0] not in table.names:
        prefix = columns[0]
        width = 4 if f"{prefix}_03" in table.names else 3
        return [f"{prefix}_{i}{j}" for i in range(3) for j in range(width)]
    return columns


def place_columns(model: Any, table: CsvTable) -> list[str | int]:
    """The columns of the coordinates, of their own or of the matrix; none where nothing says."""
    if model.position is not None and model.position.columns is not None:
        return list(model.position.columns)
    matrix = matrix_columns(model.orientation, table) if model.orientation else []
    return [matrix[i] for i in TRANSLATION.get(len(matrix), ())]


def position(model: Any, table: CsvTable, document: YamlDocument) -> tuple[Array, Array | None, Unit, Array]:
    """Positions (k, 3), their standard deviations, the unit, and what one unit in the last digit means (k, 3), in m."""
    value = model.position or PlaceValuesModel()
    at: Path_ = ("position",)
    if value.columns is None:
        found = place_columns(model, table)
        if not found:
            document.fail("no columns for the position", at, expected="position: {columns: [x, y, z], unit: mm}")
        value = value.model_copy(update={"columns": found})
    for word, given in (("unit", value.unit), ("sign", value.sign)):
        if isinstance(given, list) and len(given) != 3:
            document.fail("wrong number of entries", (*at, word), found=len(given), expected="one for each column, 3")
    numbers, sigma, units = quantity(value, table, document, at, ("m",) * 3, XYZ)
    assert value.columns is not None
    digits = table.digits(value.columns) * np.array([u.factor for u in units])
    return numbers if value.sign is None else numbers * np.array(value.sign), sigma, units[0], digits


def read_position(model: PositionModel, table: CsvTable, document: YamlDocument) -> Values:
    """Positions (k, 3) in m."""
    value, sigma, unit, digits = position(model, table, document)
    return Values(value, sigma, length=unit, digits=digits)


def write_position(obs: Observations, units: Units) -> KindOutput:
    """Three columns and their sigmas."""
    return KindOutput(columns(XYZ, XYZ_SIGMA, [units.length] * 3, obs), (section("position", XYZ, XYZ_SIGMA, obs),))


POSITION_KEYS = """position: {{columns: [x, y, z], unit: {length}, sigma: 0.02}}    # or {{columns: [sx, sy, sz]}}, or leave it out
frame: {{name: tracker, free: true}}    # where the instrument stands is found from the data
"""
POSITION = KindFile(
    "position",
    PositionModel,
    read_position,
    write_position,
    POSITION_KEYS,
    (True, True, True, False, False, False),
    located=True,
    lengths="position",
)
