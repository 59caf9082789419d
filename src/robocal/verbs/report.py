"""`report`: report.html once more, from the result.json and residuals.csv of a run folder."""

from __future__ import annotations

from pathlib import Path

from robocal._record import record
from robocal.verbs.option import BaseOptions, arg, option
from robocal.verbs.outcome import Outcome, Watch
from robocal.verbs.outcome import path_sections as sections

__all__ = ["Options", "run", "sections"]


@record
class Options(BaseOptions):
    """Write report.html again, from result.json and the tables of a run folder."""

    folder: Path = arg(..., "RUN", "A run folder with result.json and residuals.csv.")
    output: Path | None = option(None, "The page", "FILE", short="-o", otherwise="RUN/report.html")


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Path]:
    """Writes the page of a run folder. Raises FileError or FormatError."""
    from robocal.errors import FileError
    from robocal.files.runfolder import (
        ACCURACY,
        COMPARISON,
        REPORT,
        RESIDUALS,
        open_run,
        read_accuracy,
        read_comparison,
        read_residuals,
    )
    from robocal.files.writing import write_text
    from robocal.report.identified import report

    folder = open_run(o.folder)
    rows, cells, methods = folder.part(RESIDUALS), folder.part(ACCURACY), folder.part(COMPARISON)
    if rows is None:
        raise FileError("this run has no residuals", file=o.folder, expected=RESIDUALS)
    accuracy = None if cells is None else read_accuracy(cells)
    compared = None if methods is None else read_comparison(methods)
    page = report(folder.result, read_residuals(rows), accuracy, o.folder, compared)
    written = write_text(o.output or o.folder / REPORT, page)
    return Outcome(written, lambda: {"written": str(written)}, written=(written,))
