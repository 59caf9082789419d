"""`drive identify`: the cogging and friction of a motor from logs of its drive."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from robocal._record import record, replace
from robocal.report.sections import Section
from robocal.session.drive.drive_settings import DriveSettings
from robocal.verbs import shared_options as w
from robocal.verbs.option import Arg, BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch, details, run_verb

if TYPE_CHECKING:
    from robocal.session.drive.drive_group import IdentifiedDrives
    from robocal.session.drive.drive_result import IdentifiedDrive

__all__ = ["Options", "details", "run", "sections"]

OWN = DriveSettings()
LOGS = Arg(
    "LOG...", "data.yaml of a log, or a CSV whose headers carry units; the slowest are fitted, the others compared"
)


@record
class Options(BaseOptions):
    """Find the cogging and the friction of a motor from logs of its drive.

    Lead the motor slowly with a proportional position loop: 3 deg/s, two turns, in both directions, without a load. Log time, angle, and
    the current or torque that the drive asks.

    \b
    robocal drive identify sweep.csv -o run
    robocal drive identify sweep.txt --columns time=Time:s,angle=Position:rad,current=Iq:A -o run
    robocal drive identify slow.csv fast.csv --slots 18 --poles 24 -o run
    robocal drive identify m1.csv m2.csv m3.csv m4.csv --each -o motors
    robocal drive compensate run --format c

    A file may have several motors, as columns angle 1, current 1, angle 2, ...: each gets a table and a folder of its own.

    Orders are taken as long as arcs of 30 degrees that were held out are met better with them. "Improved" means that the table
    explains unseen arcs better than friction and offset alone.

    Exit status 3 when it does not, or when the log cannot tell what a table needs.
    """

    logs: Annotated[tuple[Path, ...], LOGS]
    columns: tuple[str, ...] = option(
        (), "Columns of a CSV, NAME=COLUMN:UNIT; names are time, angle, current, torque, flag; angle.left is that of motor left",
        "WORDS", listed=True,
    )  # fmt: skip
    orders: int = option(OWN.orders, "At most so many orders", "N", least=1, most=100)
    phases: str = option(
        OWN.phases, "One lag for both directions, or phases of their own; auto: what held-out arcs prefer", "WORD",
        choices=("auto", "lag", "directions"),
    )  # fmt: skip
    eccentric: bool = option(OWN.eccentric, "The encoder may be off its centre: two numbers in place of sidebands")
    slots: int | None = option(
        OWN.slots, "Slots of the motor", "N", least=1, most=1000, otherwise="as the data file says"
    )
    poles: int | None = option(
        OWN.poles, "Poles of the motor, two for each pair", "N", least=2, most=1000, otherwise="as the data file says"
    )
    method: str = option(
        OWN.method,
        "Harmonics, or the seed document's table for each direction",
        "METHOD",
        choices=("harmonics", "seed"),
    )
    degree: int = option(OWN.degree, "Degree of the polynomials of --method seed", "N", least=2, most=3)
    window: float = option(OWN.window, "Window of --method seed", "DEG", unit="deg", above=0, most=60)
    each: bool = option(False, "Every log is of a motor of its own: one table, and a folder for each")
    loaded: bool = option(False, "The logs have a load: what comes once per turn is its weight")
    output: Path | None = option(None, "Folder for motor.yaml, drive.json and report.html", "DIR", short="-o")
    force: w.Force = False


FILES = ("motor.yaml", "drive.json", "report.html")
GROUP_FILES = ("motors.json", "report.html")


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[IdentifiedDrive | IdentifiedDrives]:
    """Finds a motor in its logs, or several; each of several has a folder of its own. Raises InputError."""
    from robocal.files.writing import refuse_existing
    from robocal.session.drive.drive_group import identify_each
    from robocal.session.drive.drive_logs import folder_name, logs_by_motor
    from robocal.session.drive.drive_result import find_drive

    motors = logs_by_motor(o)
    if len(motors) == 1:
        logs = next(iter(motors.values()))
        return run_verb(o, FILES, lambda: find_drive(o, logs, watch, command), sections, details)
    own = {name: replace(o, output=None if o.output is None else o.output / folder_name(name)) for name in motors}
    for each in own.values():
        refuse_existing(each.output, FILES, o.force)
    refuse_existing(o.output, GROUP_FILES, o.force)
    found = identify_each(o, motors, watch, command)
    written: tuple[Path, ...] = ()
    for name, member in found.members.items():
        made = run_verb(own[name], FILES, partial(_same, member), sections, details)
        written = (*written, *made.written)
    outcome = run_verb(o, GROUP_FILES, lambda: found, sections, details)
    return outcome.with_files((*written, *outcome.written)) if written else outcome


def _same(found: IdentifiedDrive) -> IdentifiedDrive:
    return found


def sections(made: Outcome[Any]) -> Iterator[Section]:
    """The verdict, the shares, the orders, and the logs; of several motors their table."""
    from robocal.session.drive.drive_group import IdentifiedDrives

    if isinstance(made.result, IdentifiedDrives):
        from robocal.report.motor_group_page import group_sections

        yield from group_sections(made.result, made.written)
        return
    from robocal.report.drive_page import drive_sections

    yield from drive_sections(made.result, made.written)
