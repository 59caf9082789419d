# Made by scripts/front_stub.py from the options of the verbs.
import os
from collections.abc import Callable, Sequence
from typing import Any

from robocal.front.measurements import Measurements
from robocal.front.verb_result import Found
from robocal.session.drive.drive_group import IdentifiedDrives as _identify_IdentifiedDrives
from robocal.session.drive.drive_result import IdentifiedDrive as _identify_IdentifiedDrive
from robocal.session.drive.drive_table import DriveTable as _compensate_DriveTable
from robocal.session.drive.drive_validation import DriveValidation as _validate_DriveValidation
from robocal.session.drive.motor_trial import MotorTrial as _simulate_MotorTrial

_Path = str | os.PathLike[str]
_Given = _Path | Measurements | Found[Any]
_Watch = Callable[[dict[str, object]], None]

def identify(
    logs: _Given | Sequence[_Given],
    *,
    columns: str | Sequence[str] = (),
    orders: int = 20,
    phases: str = 'auto',
    eccentric: bool = False,
    slots: int | None = None,
    poles: int | None = None,
    method: str = 'harmonics',
    degree: int = 2,
    window: float | str = 5.0,
    each: bool = False,
    loaded: bool = False,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_identify_IdentifiedDrive | _identify_IdentifiedDrives]:
    """Find the cogging and the friction of a motor from logs of its drive.

    Lead the motor slowly with a proportional position loop: 3 deg/s, two turns, in both directions, without a load. Log time, angle, and
    the current or torque that the drive asks.

    Takes
    logs: data.yaml of a log, or a CSV whose headers carry units; the slowest are fitted, the others compared.
    columns: Columns of a CSV, NAME=COLUMN:UNIT; names are time, angle, current, torque, flag; angle.left is that of motor left.
    orders: At most so many orders, 1 to 100.  [default: 20]
    phases: One lag for both directions, or phases of their own; auto: what held-out arcs prefer.  [default: 'auto']
    eccentric: The encoder may be off its centre: two numbers in place of sidebands.
    slots: Slots of the motor, 1 to 1000.  [default: as the data file says]
    poles: Poles of the motor, two for each pair, 2 to 1000.  [default: as the data file says]
    method: Harmonics, or the seed document's table for each direction: harmonics, seed.  [default: 'harmonics']
    degree: Degree of the polynomials of method='seed', 2 to 3.  [default: 2]
    window: Window of method='seed' [deg], above 0 and at most 60.  [default: 5.0]
    each: Every log is of a motor of its own: one table, and a folder for each.
    loaded: The logs have a load: what comes once per turn is its weight.
    output: Folder for motor.yaml, drive.json and report.html.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (IdentifiedDrive | IdentifiedDrives, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def validate(
    motor: _Given,
    log: _Given,
    *,
    columns: str | Sequence[str] = (),
    beside: _Path | Sequence[_Path] = ...,
    loaded: bool = False,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_validate_DriveValidation]:
    """Ask what the table of a motor explains of another log, at any speed.

    Takes
    motor: The folder of rc.drive.identify, or its motor.yaml; or what identify gave and wrote.
    log: data.yaml of another log, or a CSV whose headers carry units.
    columns: Columns of a CSV, NAME=COLUMN:UNIT; names are time, angle, current, torque, flag.
    beside: Other runs of the same motor, whose tables are compared row by row.
    loaded: The log has a load: what comes once per turn is its weight.
    output: Folder for validation.json and report.html.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (DriveValidation, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def compensate(
    motor: _Given,
    *,
    format: str = 'csv',
    cells: int = 3600,
    unit: str | None = None,
    friction: bool = False,
    torque_constant: float | str | None = None,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_compensate_DriveTable]:
    """Write the table that compensates a motor's cogging, for a controller.

    Takes
    motor: The folder of rc.drive.identify, or its motor.yaml; or what identify gave and wrote.
    format: Form of the table: csv, json, c, c-float, odrive, array.  [default: 'csv']
    cells: Cells of the turn; odrive has 3600, 36 to 65536.  [default: 3600]
    unit: Unit of the table: A, Nm.  [default: that of the log]
    friction: Add Coulomb friction, each direction its own.
    torque_constant: Torque constant k_c: current is torque divided by it [Nm/A], above 0.  [default: that of the log's data file]
    output: Write here, not to the terminal.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (DriveTable, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def simulate(
    spec: _Given,
    *,
    gain: float | str | None = None,
    speed: float | str | None = None,
    seed: int = 0,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_simulate_MotorTrial]:
    """Simulate the whole procedure on a motor: a slow sweep, identification of the cogging, compensation, and a test on a ramp.

    The sweep is driven by a proportional controller, in both directions. The ramp is followed by PID controllers, without compensation,
    with it, and with a table without its mean. The log is a file that `drive identify` reads.

    Takes
    spec: motor.yaml of a motor to be simulated: what it truly is, its sweep and its ramp.
    gain: Proportional gain of the sweep [N m/rad], above 0.  [default: the first of the file]
    speed: Speed of the sweep [deg/s], above 0 and at most 1000.  [default: as the file says]
    seed: Seed of the noise, 0 or more.
    output: Write simulate.json, sweep.csv, sweep.yaml, truth.csv, ramp.csv and report.html here.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (MotorTrial, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """
