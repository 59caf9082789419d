"""What `drive validate` finds: how much of another log a motor's table explains, part by part, and whether the log is of this motor."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record
from robocal._types import Bools
from robocal.diagnose.drive_limits import FLAG_TURNS, TABLE_EXPLAINS
from robocal.drives.drive_sweep import Sweep, escaped_rows
from robocal.drives.motor import ECCENTRIC, GAIN, LAG, Motor, motor_of, order_names
from robocal.drives.seed_table import table_harmonics
from robocal.errors import ModelError
from robocal.files.drive_log import DriveLog, read_drive_log
from robocal.files.motor_file import MotorFile, read_motor
from robocal.files.parts import Document, Origin
from robocal.files.plain import json_text
from robocal.quantities import Column, Listing
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.report.sections import Section
from robocal.session.drive.drive_checks import check_speed
from robocal.session.drive.drive_table import doubt_motor
from robocal.session.drive.foreign_log import contradiction
from robocal.session.drive.table_share import Explained, compensated_turns, explain
from robocal.session.verb_base import VerbResult
from robocal.session.watching import computable

__all__ = ["DriveValidation", "DriveValidationDocument", "validate_drive"]

WORDS = {True: "compensated", False: "not compensated"}


@record(kw_only=True)
class DriveValidationDocument(Document):
    """validation.json: the motor, the log, and a row for each part of the log, told apart by its effort."""

    motor: str
    log: str
    parts: Listing
    provenance: Origin


@record(kw_only=True, eq=False)
class DriveValidation(VerbResult):
    """A log beside the table of a motor."""

    name: str  # of the table
    motor: Motor
    log: DriveLog
    on: Bools  # which rows were compensated, as their effort says
    parts: Mapping[bool, Explained]
    beside: Mapping[str, Mapping[bool, Explained]]  # the same of other tables, by the name of their runs

    @property
    def sweep(self) -> Sweep:
        """The rows of the log."""
        return self.log.sweep

    @cached_property
    def listing(self) -> Listing:
        """A row for each part, and for each table where several are compared; speeds and angles in the unit of the log."""
        tables = {self.name: self.parts, **self.beside}
        rows = [(name, k, e) for k in self.parts for name, parts in tables.items() for e in (parts[k],)]
        of = [e for _, _, e in rows]
        log, effort = self.log, self.sweep.unit.replace(" ", "")
        table = (Column("table", "", [name for name, _, _ in rows]),) if self.beside else ()
        return Listing(
            (
                Column("part", "", [WORDS[k] for _, k, _ in rows]),
                *table,
                Column("rows", "", [e.rows for e in of]),
                Column("speed", log.speed_unit, log.in_angle_unit([e.speed for e in of]), figures=3),
                Column("scatter", log.speed_unit, log.in_angle_unit([e.scatter for e in of]), figures=3),
                Column("alone", "", [e.alone for e in of], spec=".1%", label="table alone"),
                Column("fitted", "", [e.fitted for e in of], spec=".1%", label="with lag, gain, inertia"),
                Column("best", "", [e.best for e in of], spec=".1%", label="own fit of the same orders"),
                Column("gain", "", [e.gain for e in of], figures=3),
                Column("lag", log.angle_unit, log.in_angle_unit([e.lag for e in of]), figures=3),
                Column(
                    "inertia", f"{effort} s s/{log.angle_unit}", np.array([e.inertia for e in of]) / log.in_angle_unit(1.0), figures=3
                ),
            )
        )  # fmt: skip

    @property
    def head(self) -> dict[str, Any]:
        """What stands at the head of its page."""
        facts = (("Motor", self.motor.name), ("Log", self.log.path.name))
        return {"title": f"{self.motor.name} in {self.log.path.name}", "kind": "Drive", "facts": facts}

    @property
    def document(self) -> DriveValidationDocument:
        """What --json says."""
        return self.document_of(
            DriveValidationDocument, motor=self.motor.name, log=str(self.log.path), parts=self.listing
        )

    def texts(self) -> Mapping[str, str | bytes]:
        """The document."""
        return {"validation.json": json_text(self.document)}

    def details(self) -> Iterator[Section]:
        """The speed and the effort of each part over a sixth of a turn."""
        from robocal.report.drive_speed import speed_pictures

        yield from speed_pictures(self)


def motor_from_file(file: MotorFile) -> Motor:
    """The motor of a file as a model; tables as their own harmonics."""
    c = file.cogging if file.table is None else table_harmonics(file.table)
    made = motor_of(file.name, c.orders, file.unit, 1.0, by_direction=c.by_direction)
    values = {LAG: c.lag, GAIN: 1.0, ECCENTRIC[0]: c.eccentric[0], ECCENTRIC[1]: c.eccentric[1]}
    for i, n in enumerate(c.orders):
        values |= dict(zip(order_names(n), (c.cosine[i], c.sine[i]), strict=True))
        if c.by_direction:
            values |= dict(zip(order_names(n, True), (c.cosine_change[i], c.sine_change[i]), strict=True))
    return made.with_values(values)


def _table_name(place: Path, file: MotorFile) -> str:
    """What a table is called beside others: its run and its method."""
    run = place if place.is_dir() else place.parent
    return f"{run.name or run.resolve().name}, {'harmonics' if file.table is None else 'tables of the seed'}"


def validate_drive(o: Any, command: str) -> DriveValidation:
    """A log beside a run, and beside other runs of the same motor. Raises InputError."""
    files = {Path(p): read_motor(Path(p)) for p in (o.motor, *o.beside)}
    log = read_drive_log(o.log, o.columns).with_load(o.loaded)
    for place, file in files.items():
        if log.sweep.unit != file.unit:
            found, expected = ("current" if u == "A" else "torque" for u in (log.sweep.unit, file.unit))
            message = "the log has another effort than the motor"
            raise ModelError(message, key=f"{log.path} beside {place}", found=found, expected=expected)
    motors = {_table_name(place, file): motor_from_file(file) for place, file in files.items()}
    if len(motors) < 1 + len(o.beside):
        raise ModelError(
            "two runs have one name", key="--beside", found=", ".join(map(str, files)), expected="runs that differ"
        )
    name, motor = next(iter(motors.items()))
    with computable(log.path):
        used = log.sweep.used & ~escaped_rows(log.sweep)
        on = compensated_turns(motor, log.sweep)
        there = [k for k in (True, False) if (used & (on == k)).any()]
        every = {n: {k: explain(m, log.sweep, used & (on == k)) for k in there} for n, m in motors.items()}
        parts = every.pop(name)
        warnings, reasons = _judge(motor, files[Path(o.motor)], log, used, on, parts)
        if (unproven := doubt_motor(files[Path(o.motor)])) is not None:
            (reasons if files[Path(o.motor)].verdict == "refused" else warnings).append(unproven)
    inputs = (*(f.file for f in files.values() if f.file is not None), *log.files)
    return DriveValidation(
        name=name, motor=motor, log=log, on=on, parts=parts, beside=every, warnings=tuple(warnings), reasons=tuple(reasons),
        inputs=inputs, command=command,
    )  # fmt: skip


def _judge(
    motor: Motor, file: MotorFile, log: DriveLog, used: Bools, on: Bools, parts: Mapping[bool, Explained]
) -> tuple[list[Remark], list[Remark]]:
    """What is worth knowing, and why the table is not of this log's motor."""
    warnings, reasons = [*log.remarks], list[Remark]()
    some = log.sweep.take(used)
    missing = max(some.missing[d] for d in (1, -1) if (some.direction == d).any())
    if missing:
        warnings.append(Remark.of(Code.DRIVE_PART_COMPARED, log=log.path.name, missing=missing))
    warnings += [r for r, _ in check_speed(some)]
    why = contradiction(motor, file.coulomb, log, used, parts)
    if why is not None:
        reasons.append(why)
    elif False in parts and parts[False].best < TABLE_EXPLAINS:
        warnings.append(Remark.of(Code.DRIVE_NO_POSITION_TABLE, best=parts[False].best))
    warnings += _flags(log.sweep, on)
    return warnings, reasons


def _flags(sweep: Sweep, on: Bools) -> Iterator[Remark]:
    """Where the log's own column says otherwise than its effort."""
    if sweep.flag is None:
        return
    said = sweep.flag != 0
    turn = np.floor(sweep.angle / (2 * np.pi)).astype(np.int64)
    for word in (True, False):
        wrong = (said == word) & (on != word)
        turns = [t for t in np.unique(turn[wrong]) if wrong[turn == t].mean() > 0.5]  # grid: most of a turn
        if len(turns) >= FLAG_TURNS:
            said_word, found = ("on", "off") if word else ("off", "on")
            yield Remark.of(Code.DRIVE_FLAG, said=said_word, rows=int(wrong.sum()), found=found)
