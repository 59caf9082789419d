"""accuracy_map.csv: one row per cell of a slice through the workspace, in mm."""

from __future__ import annotations

import os
from typing import Any

from robocal.apply.accuracy import AccuracyMap
from robocal.files.csvtable import csv_text, read_csv

__all__ = ["MAP_COLUMNS", "accuracy_columns", "accuracy_text", "read_accuracy"]

MAP_COLUMNS = ("slice", "x_mm", "y_mm", "z_mm", "side_mm", "nominal_error_mm", "band_mm", "n")


def accuracy_columns(found: AccuracyMap) -> dict[str, list[Any]]:
    """The columns of accuracy_map.csv."""
    out: dict[str, list[Any]] = {name: [] for name in MAP_COLUMNS}
    for s in found.slices:
        for i in range(len(s.centre)):
            x, y, z = (1e3 * float(v) for v in s.centre[i])
            row = (s.name, x, y, z, 1e3 * s.side, 1e3 * float(s.error[i]), 1e3 * float(s.band[i]), int(s.count[i]))
            for name, value in zip(MAP_COLUMNS, row, strict=True):
                out[name].append(value)
    return out


def accuracy_text(columns: dict[str, list[Any]]) -> str:
    """The text of accuracy_map.csv."""
    rows = zip(*(columns[name] for name in MAP_COLUMNS), strict=True)
    return csv_text(MAP_COLUMNS, ([f"{v:.6g}" if isinstance(v, float) else v for v in row] for row in rows))


def read_accuracy(path: str | os.PathLike[str]) -> dict[str, list[Any]]:
    """The columns of an accuracy_map.csv. Raises FileError or FormatError."""
    table = read_csv(path, separator=",")
    out: dict[str, list[Any]] = {"slice": list(table.texts("slice"))}
    for name in MAP_COLUMNS[1:]:
        out[name] = table.numbers([name])[:, 0].tolist()
    return out
