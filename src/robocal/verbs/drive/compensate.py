"""`drive compensate`: the table of a motor for a controller."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from robocal._record import record
from robocal.report.sections import Section
from robocal.verbs import shared_options as w
from robocal.verbs.option import Arg, BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch, path_sections, run_verb

if TYPE_CHECKING:
    from robocal.session.drive.drive_table import DriveTable

__all__ = ["Options", "run", "sections"]

RUN = Arg("RUN", "The folder of robocal drive identify, or its motor.yaml.")


@record
class Options(BaseOptions):
    """Write the table that compensates a motor's cogging, for a controller.

    \b
    robocal drive compensate run --format csv -o table.csv
    robocal drive compensate run --format c --cells 1024 -o cogging.h
    robocal drive compensate run --format odrive --torque-constant 0.561 -o map.json

    The file says its unit, and how to look up: from the encoder's index, by setpoint or angle, in the desired direction. What is written
    was read back and is the same bit for bit.
    """

    motor: Annotated[Path, RUN]
    format: str = option("csv", "Form of the table", "FORM", choices=("csv", "json", "c", "c-float", "odrive", "array"))
    cells: int = option(3600, "Cells of the turn; odrive has 3600", "N", least=36, most=65536)
    unit: str | None = option(None, "Unit of the table", "UNIT", choices=("A", "Nm"), otherwise="that of the log")
    friction: bool = option(False, "Add Coulomb friction, each direction its own")
    torque_constant: float | None = option(
        None,
        "Torque constant k_c: current is torque divided by it",
        "K",
        unit="Nm/A",
        above=0,
        otherwise="that of the log's data file",
    )
    output: w.OutputFile = None
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[DriveTable]:
    """Makes the table. Raises InputError."""
    from robocal.session.drive.drive_table import find_compensation

    return run_verb(o, (), lambda: find_compensation(o, command))


def sections(made: Outcome[DriveTable]) -> Iterator[Section]:
    """Where the file is."""
    yield from path_sections(made)
