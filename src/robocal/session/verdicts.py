"""What the run folder that a robot was opened from says of its model."""

from __future__ import annotations

from pathlib import Path

from robocal.files.result import Result
from robocal.files.runfolder import find_run
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["run_doubts", "run_result"]


def run_result(name: str) -> Result | None:
    """The result of the run folder that a robot was opened from; None for a file or a catalogue name."""
    run = find_run(name) if Path(name).is_dir() else None
    return None if run is None else run.result


def run_doubts(name: str) -> tuple[Remark, ...]:
    """What is to be said of a run folder whose model is handed on although its verdict is not `improved`."""
    known = run_result(name)
    if known is None or known.verdict.status == "improved":
        return ()
    return (Remark.of(Code.RUN_REFUSED if known.verdict.status == "refused" else Code.RUN_NOT_IMPROVED, run=name),)
