"""What a run folder predicts of rows that nobody measured: a document for machines and a table for people, of any machine."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from robocal.estimate.uncertainty import LEVEL
from robocal.files.csvtable import csv_text
from robocal.files.parts import hashes
from robocal.files.text import InputFile
from robocal.files.units import number
from robocal.remarks.remark import Remark, told

__all__ = ["Prediction"]


@dataclass(frozen=True)
class Prediction:
    """Predicted rows with 95 % bands (mm, deg), in the order of the file, under `key` of the document; `relative_to` says what the bands
    leave out, `what` what the rows are, `columns` and `cells` what people read of them, and `notes` how."""

    name: str
    rows: tuple[dict[str, Any], ...]
    relative_to: str
    what: str
    columns: tuple[str, ...]
    cells: tuple[tuple[str, ...], ...]
    notes: str
    inputs: tuple[InputFile, ...]
    warnings: tuple[Remark, ...]
    written: tuple[Path, ...] = ()
    key: str = "poses"

    @property
    def document(self) -> dict[str, Any]:
        """What --json prints."""
        return {
            "robocal": 1,
            "robot": self.name,
            "level": LEVEL,
            "relative_to": self.relative_to,
            "units": {"length": "mm", "angle": "deg"},
            self.key: list(self.rows),
            "inputs": hashes(self.inputs),
            **told(self.warnings),
            "written": [str(p) for p in self.written],
        }

    @property
    def text(self) -> str:
        """The rows as a CSV."""
        names = list(self.rows[0]) if self.rows else ["configuration"]
        every = ([r[n] for n in names] for r in self.rows)
        cells = (["" if v is None else v if isinstance(v, str) else number(v) for v in row] for row in every)
        return csv_text([_header(n) for n in names], cells)


def _header(name: str) -> str:
    stem, _, unit = name.rpartition("_")
    return f"{stem} [{unit}]" if unit in ("mm", "deg") else name
