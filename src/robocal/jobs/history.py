"""The history of a robot: a CSV to which calibrations are added, one row for each parameter that was identified."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

from robocal.errors import FormatError
from robocal.files.csvtable import csv_text
from robocal.files.runfolder import Run
from robocal.files.text import read_text
from robocal.files.units import number

__all__ = ["HEADER", "with_history"]

HEADER = ("started", "robot", "run", "verdict", "parameter", "value", "sigma", "unit")


def with_history(place: Path, runs: Sequence[Run]) -> str:
    """The text of the history with these runs added; those that it has already, by time, robot and folder, are not added again. Raises
    FormatError for a file that is no history."""
    rows: list[list[str]] = []
    if place.exists():
        found = list(csv.reader(io.StringIO(read_text(place).text)))
        if not found or tuple(found[0]) != HEADER:
            said = ",".join(found[0])[:80] if found else "an empty file"
            raise FormatError("this is no history", file=place, row=1, found=said, expected=",".join(HEADER))
        for line, row in enumerate(found[1:], start=2):
            if len(row) != len(HEADER):
                raise FormatError(
                    "not a row of a history", file=place, row=line, found=f"{len(row)} cells", expected=str(len(HEADER))
                )
        rows = found[1:]
    known = {tuple(r[:3]) for r in rows}
    for run in runs:
        result = run.result
        who = (result.provenance.started, result.robot.name, str(run.folder))
        if who in known:
            continue
        known.add(who)
        for p in result.parameters:
            if p.status in ("identified", "prior") and p.identified is not None:
                sigma = "" if p.sigma is None else number(p.sigma)
                rows.append([*who, result.verdict.status, p.name, number(p.identified), sigma, p.unit])
    return csv_text(HEADER, rows)
