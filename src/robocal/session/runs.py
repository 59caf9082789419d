"""What runs are made of and came to: the tables that two of them share, what is to be said of one that did not improve, what they know
of their parameters, and their history: a CSV to which calibrations are added, one row for each parameter that was identified."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

from robocal.errors import FileError, FormatError
from robocal.files.covariance import COVARIANCE, Knowledge, read_covariance
from robocal.files.csvtext import csv_text
from robocal.files.result import Result
from robocal.files.runfolder import Run, find_run, open_run
from robocal.files.text import read_text
from robocal.files.units import finite, number, parse_unit
from robocal.parameters import ParameterTable
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = [
    "HEADER", "knowledge_of", "run_cautions", "run_result", "shared_files", "tables_by_hash", "verdict_remarks", "with_history",
]  # fmt: skip

SAME = 1e-7  # tolerance: of a value that was written and read
HEADER = ("started", "robot", "run", "verdict", "parameter", "value", "sigma", "unit")


def tables_by_hash(result: Result) -> dict[str, str]:
    """The tables that a run was made of: their names by SHA-256."""
    return {i.sha256: Path(i.file).name for i in result.provenance.inputs if i.file.lower().endswith(".csv")}


def shared_files(one: Result, other: Result) -> tuple[str, ...]:
    """The tables that both runs were made of, as the other names them."""
    first = tables_by_hash(one)
    return tuple(name for sha, name in tables_by_hash(other).items() if sha in first)


def verdict_remarks(result: Result | None, name: str) -> tuple[Remark, ...]:
    """What is to be said of a run that did not improve its machine."""
    status = "improved" if result is None else result.verdict.status
    if status in ("improved", "located"):
        return ()
    return (Remark.of(Code.RUN_REFUSED if status == "refused" else Code.RUN_NOT_IMPROVED, run=name),)


def knowledge_of(folder: Path, table: ParameterTable | None) -> Knowledge:
    """What a run folder knows of its parameters; `table` is that of the arm that was opened from it (None: another machine was). Raises
    FileError when it does not say, FormatError when it speaks of another robot."""
    run = open_run(folder)
    place = run.part(COVARIANCE)
    if place is None:
        expected = f"{COVARIANCE}: identify once more with this version"
        raise FileError("this run does not contain the uncertainty of its parameters", file=folder, expected=expected)
    if run.result is not None and run.result.verdict.status == "located":
        expected = "a run that identified the robot too (leave out --free)"
        raise FileError("this run located frames alone, and says nothing of the robot", file=folder, expected=expected)
    known = read_covariance(place)
    if table is None:
        return known
    for name, value in known.values.items():
        if name in table and abs(table[name].value - value) > SAME * max(1.0, abs(value)):
            message = "this file does not belong to the calibrated robot beside it"
            raise FormatError(message, file=place, key=name, found=value, expected=table[name].value)
    return known


def run_result(name: str) -> Result | None:
    """The result of the run folder that a robot was opened from; None for a file or a catalogue name."""
    run = find_run(name) if Path(name).is_dir() else None
    return None if run is None else run.result


def run_cautions(name: str) -> tuple[Remark, ...]:
    """Remarks on a run folder whose model is handed on although its verdict is not `improved`."""
    return verdict_remarks(run_result(name), name)


def with_history(place: Path, runs: Sequence[Run]) -> str:
    """The text of the history with these runs added; rows that it has already, of the same time, robot and parameter with the same value,
    are not added again, wherever the run lies now. Raises FormatError for a file that is no history."""
    rows: list[list[str]] = []
    if place.exists():
        reader = csv.reader(io.StringIO(read_text(place).text))
        try:
            found = list(reader)
        except csv.Error as error:
            raise FormatError(f"the row cannot be split into cells: {error}", file=place, row=reader.line_num) from None
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
        if finite(cells[name]) is None and (cells[name] or name == "value"):
            expected = "a finite number"
            raise FormatError("not a number", file=place, row=line, column=name, found=cells[name], expected=expected)
    parse_unit(cells["unit"], file=place, row=line, column="unit")
