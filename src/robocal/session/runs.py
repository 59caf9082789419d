"""What runs are made of and came to: the tables that two of them share, and what is to be said of one that did not improve."""

from __future__ import annotations

from pathlib import Path

from robocal.files.result import Result
from robocal.files.runfolder import find_run
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["run_cautions", "run_result", "shared_files", "tables_by_hash", "verdict_remarks"]


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
    if status == "improved":
        return ()
    return (Remark.of(Code.RUN_REFUSED if status == "refused" else Code.RUN_NOT_IMPROVED, run=name),)


def run_result(name: str) -> Result | None:
    """The result of the run folder that a robot was opened from; None for a file or a catalogue name."""
    run = find_run(name) if Path(name).is_dir() else None
    return None if run is None else run.result


def run_cautions(name: str) -> tuple[Remark, ...]:
    """Remarks on a run folder whose model is handed on although its verdict is not `improved`."""
    return verdict_remarks(run_result(name), name)
