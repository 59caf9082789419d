"""The history of a robot: a CSV to which calibrations are added, one row for each parameter that was identified."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from pathlib import Path

from robocal.errors import FormatError
from robocal.files.csvtable import csv_text
from robocal.files.runfolder import Run
from robocal.files.text import read_text
from robocal.files.units import number, parse_unit

__all__ = ["HEADER", "with_history"]

HEADER = ("started", "robot", "run", "verdict", "parameter", "value", "sigma", "unit")


def with_history(place: Path, runs: Sequence[Run]) -> str:
    """The text of the history with these runs added; rows that it has already, of the same time, robot and parameter with the same value,
    are not added again, wherever the run lies now. Raises FormatError for a file that is no history."""
    rows: list[list[str]] = []
    if place.exists():
        found = list(csv.reader(io.StringIO(read_text(place).text)))
        if not found or tuple(found[0]) != HEADER:
            said = ",".join(found[0])[:80] if found else "an empty file"
            raise FormatError("this is no history", file=place, row=1, found=said, expected=",".join(HEADER))
        rows = found[1:]
        for line, row in enumerate(rows, start=2):
            _check(place, line, row)
    known = {_who(r) for r in rows}
    for run in runs:
        result = run.result
        who = (result.provenance.started, result.robot.name, str(run.folder))
        for p in result.parameters:
            if p.status in ("identified", "prior") and p.identified is not None:
                sigma = "" if p.sigma is None else number(p.sigma)
                row = [*who, result.verdict.status, p.name, number(p.identified), sigma, p.unit]
                if _who(row) not in known:
                    known.add(_who(row))
                    rows.append(row)
    return csv_text(HEADER, rows)


def _who(row: Sequence[str]) -> tuple[str, ...]:
    """What a row is of: time, robot, parameter, value and unit."""
    return row[0], row[1], row[4], row[5], row[7]


def _check(place: Path, line: int, row: Sequence[str]) -> None:
    if len(row) != len(HEADER):
        found, expected = f"{len(row)} cells", str(len(HEADER))
        raise FormatError("not a row of a history", file=place, row=line, found=found, expected=expected)
    cells = dict(zip(HEADER, row, strict=True))
    for name in ("value", "sigma"):
        try:
            good = math.isfinite(float(cells[name])) if cells[name] or name == "value" else True
        except ValueError:
            good = False
        if not good:
            expected = "a finite number"
            raise FormatError("not a number", file=place, row=line, column=name, found=cells[name], expected=expected)
    parse_unit(cells["unit"], file=place, row=line, column="unit")
