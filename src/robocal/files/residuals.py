"""residuals.csv of a run folder, read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from robocal.errors import FormatError
from robocal.files.csvtable import CsvTable, read_csv
from robocal.files.run_documents import RESIDUAL_COLUMNS

__all__ = ["read_residuals"]

TEXTS = ("configuration", "set", "set_aside", "group", "kind", "target", "fingerprint")
LATER = ("set_aside", "fingerprint")  # columns that older folders do not have


def read_residuals(path: Path) -> dict[str, list[Any]]:
    """The columns of residuals.csv, None for empty cells. Raises FileError or FormatError."""
    table = read_csv(path, separator=",")
    out: dict[str, list[Any]] = {}
    for name in RESIDUAL_COLUMNS:
        if name in LATER and name not in table.names:
            continue
        at = table.find(name)
        cells = [row[at].strip() for row in table.cells]
        out[name] = cells if name in TEXTS else [_number(c, table, row, name) for row, c in enumerate(cells)]
    return out


def _number(cell: str, table: CsvTable, row: int, column: str) -> float | None:
    if not cell:
        return None
    try:
        return float(cell)
    except ValueError:
        raise FormatError(
            "not a number", file=table.path, row=int(table.lines[row]), column=column, found=cell, expected="a number"
        ) from None
