"""The run folder of one identification: result.json, the calibrated robot, residuals.csv, report.html; all of them, or
none."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from robocal.errors import nearest
from robocal.files.csvtable import csv_columns
from robocal.files.names import harmless
from robocal.files.result import Result
from robocal.files.runfolder import PARTS, REPORT, RESIDUALS, RESULT, ROBOTS
from robocal.files.writing import write_files

__all__ = ["RESIDUAL_COLUMNS", "residual_text", "write_run"]

RESIDUAL_COLUMNS = (
    "configuration", "set", "set_aside", "group", "kind", "target",
    "x_mm", "y_mm", "z_mm",
    "before_mm", "after_mm", "held_out_mm",
    "dx_before_mm", "dy_before_mm", "dz_before_mm",
    "dx_after_mm", "dy_after_mm", "dz_after_mm",
    "angle_before_deg", "angle_after_deg", "angle_held_out_deg",
    "before_px", "after_px", "held_out_px",
    "fingerprint",
)  # fmt: skip


INFINITE = float("inf")


def residual_text(columns: Mapping[str, Sequence[Any]]) -> str:
    """residuals.csv: one row per observation; columns that are not given, None and NaN are empty cells."""
    for name in columns:
        if name not in RESIDUAL_COLUMNS:
            raise ValueError(f"residuals.csv has no column {name!r}; did you mean {nearest(name, RESIDUAL_COLUMNS)!r}?")
    lengths = {len(values) for values in columns.values()}
    if len(lengths) > 1:
        raise ValueError(f"columns of different length: {sorted(lengths)}")
    count = max(lengths, default=0)
    return csv_columns(
        RESIDUAL_COLUMNS, [_cells(columns[name]) if name in columns else [""] * count for name in RESIDUAL_COLUMNS]
    )


def _cells(values: Sequence[Any]) -> list[str]:
    """A column as it is written: texts that a spreadsheet takes for texts, numbers with nine digits."""
    return [
        str(harmless(v)) if isinstance(v, str) else f"{v:.9g}" if v is not None and -INFINITE < v < INFINITE else ""
        for v in values
    ]


def write_run(
    folder: str | os.PathLike[str],
    result: Result,
    robot_text: str | None,
    residuals: Mapping[str, Sequence[Any]] | None,
    report: str | None,
    *,
    robot_name: str = ROBOTS[0],
    more: Mapping[str, str] | None = None,
) -> tuple[Path, ...]:
    """Writes a run folder, with `more` texts by file name; files of an earlier run that this one does not have are
    removed. result.json records what the others are. Raises FileError, and then nothing changed."""
    files = dict(more or {})
    if robot_text is not None:
        files[robot_name] = robot_text
    if residuals is not None:
        files[RESIDUALS] = residual_text(residuals)
    recorded = {name: hashlib.sha256(text.encode()).hexdigest() for name, text in files.items()}
    if report is not None:
        files[REPORT] = report
    texts = {RESULT: replace(result, files=recorded).to_json(), **files}
    return write_files(folder, texts, remove=(REPORT, *PARTS))
