"""The verb `report`: report.html once more, from the result.json and residuals.csv of a run folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from robocal.errors import FileError, FormatError
from robocal.files.accuracy import read_accuracy
from robocal.files.csvtable import CsvTable, read_csv
from robocal.files.run import RESIDUAL_COLUMNS
from robocal.files.runfolder import ACCURACY, REPORT, RESIDUALS, open_run
from robocal.files.writing import write_text

__all__ = ["read_residuals", "report"]

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


def report(folder: Path, output: Path | None = None) -> Path:
    """Writes the page of a run folder. Raises FileError, FormatError, or MissingExtra without the report extra."""
    from robocal.report.page import render

    run = open_run(folder)
    rows, cells = run.part(RESIDUALS), run.part(ACCURACY)
    if rows is None:
        raise FileError("this run has no residuals", file=folder, expected=RESIDUALS)
    page = render(
        run.result.model_dump(mode="json"), read_residuals(rows), None if cells is None else read_accuracy(cells)
    )
    return write_text(output or folder / REPORT, page)
