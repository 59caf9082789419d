"""`drive validate`: what the table of a motor explains of another log."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from robocal._record import record
from robocal.report.sections import Section
from robocal.verbs import shared_options as w
from robocal.verbs.option import Arg, BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch, details, run_verb

if TYPE_CHECKING:
    from robocal.session.drive.drive_validation import DriveValidation

__all__ = ["Options", "details", "run", "sections"]

RUN = Arg("RUN", "The folder of robocal drive identify, or its motor.yaml.")
LOG = Arg("LOG", "data.yaml of another log, or a CSV whose headers carry units.")


@record
class Options(BaseOptions):
    """Ask what the table of a motor explains of another log, at any speed.

    \b
    robocal drive validate run speed.csv
    robocal drive validate run speed.txt --columns time=Time:s,angle=Position:rad,current=Iq:A,flag=Active -o checked
    robocal drive validate run speed.csv --beside seed-run          tables of --method seed beside harmonics

    Turns whose effort is mostly what the table says were compensated, whatever a column of the log says of it.

    Exit status 3 when the log is of another motor, or its angle counts from elsewhere.
    """

    motor: Annotated[Path, RUN]
    log: Annotated[Path, LOG]
    columns: tuple[str, ...] = option(
        (), "Columns of a CSV, NAME=COLUMN:UNIT; names are time, angle, current, torque, flag", "WORDS", listed=True
    )
    beside: tuple[Path, ...] = option(
        (), "Other runs of the same motor, whose tables are compared row by row", "RUN", listed=True
    )
    loaded: bool = option(False, "The log has a load: what comes once per turn is its weight")
    output: Path | None = option(None, "Folder for validation.json and report.html", "DIR", short="-o")
    force: w.Force = False


FILES = ("validation.json", "report.html")


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[DriveValidation]:
    """Compares a log with a motor. Raises InputError."""
    from robocal.session.drive.drive_validation import validate_drive

    return run_verb(o, FILES, lambda: validate_drive(o, command), sections, details)


def sections(made: Outcome[DriveValidation]) -> Iterator[Section]:
    """The shares of each part."""
    from robocal.report.drive_speed import validation_sections

    yield from validation_sections(made.result, made.written)
