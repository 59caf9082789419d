"""What `drive validate` finds: how much of another log a motor's table explains, part by part, and whether the log is of this motor."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record
from robocal._types import Bools
from robocal.diagnose.drive_limits import FLAG_TURNS, OTHER_GAIN, SHIFT_BETTER, SHIFT_LEAST, TABLE_EXPLAINS
from robocal.drives.drive_sweep import Sweep, escaped_rows
from robocal.drives.motor import ECCENTRIC, GAIN, LAG, Motor, motor_of, order_names
from robocal.errors import ModelError
from robocal.files.drive_log import DriveLog, read_drive_log
from robocal.files.motor_file import MotorFile, read_motor
from robocal.files.parts import Document, Origin
from robocal.files.plain import json_text
from robocal.quantities import Column, Listing
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.report.sections import Section
from robocal.session.drive.table_share import Explained, best_shift, compensated_turns, explain
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

    motor: Motor
    log: DriveLog
    on: Bools  # which rows were compensated, as their effort says
    parts: Mapping[bool, Explained]

    @property
    def sweep(self) -> Sweep:
        """The rows of the log."""
        return self.log.sweep

    @cached_property
    def listing(self) -> Listing:
        """A row for each part."""
        rows = list(self.parts.items())
        unit = self.sweep.unit
        return Listing(
            (
                Column("part", "", [WORDS[k] for k, _ in rows]),
                Column("rows", "", [e.rows for _, e in rows]),
                Column("speed", "rad/s", [e.speed for _, e in rows], figures=3),
                Column("scatter", "rad/s", [e.scatter for _, e in rows], figures=3, label="its scatter [rad/s]"),
                Column("alone", "", [e.alone for _, e in rows], spec=".1%", label="table alone"),
                Column("fitted", "", [e.fitted for _, e in rows], spec=".1%", label="with lag, gain, inertia"),
                Column("best", "", [e.best for _, e in rows], spec=".1%", label="own fit of the same orders"),
                Column("gain", "", [e.gain for _, e in rows], figures=3),
                Column("lag", "deg", [float(np.degrees(e.lag)) for _, e in rows], figures=3),
                Column("inertia", f"{unit.replace(' ', '')} s s/rad", [e.inertia for _, e in rows], figures=3),
            )
        )

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
    """The motor of a file as a model. Raises ModelError for one of tables alone."""
    if file.table is not None:
        raise ModelError("a table for each direction is no model", key="method", found="seed", expected="harmonics")
    c = file.cogging
    made = motor_of(file.name, c.orders, file.unit, 1.0, by_direction=c.by_direction)
    values = {LAG: c.lag, GAIN: 1.0, ECCENTRIC[0]: c.eccentric[0], ECCENTRIC[1]: c.eccentric[1]}
    for i, n in enumerate(c.orders):
        values |= dict(zip(order_names(n), (c.cosine[i], c.sine[i]), strict=True))
        if c.by_direction:
            values |= dict(zip(order_names(n, True), (c.cosine_change[i], c.sine_change[i]), strict=True))
    return made.with_values(values)


def validate_drive(o: Any, command: str) -> DriveValidation:
    """A log beside a run. Raises InputError."""
    file = read_motor(Path(o.motor))
    log = read_drive_log(o.log, o.columns)
    if log.sweep.unit != file.unit:
        found, expected = ("current" if u == "A" else "torque" for u in (log.sweep.unit, file.unit))
        raise ModelError("the log has another effort than the motor", key=str(log.path), found=found, expected=expected)
    motor = motor_from_file(file)
    with computable(log.path):
        used = log.sweep.used & ~escaped_rows(log.sweep)
        on = compensated_turns(motor, log.sweep)
        parts = {k: explain(motor, log.sweep, used & (on == k)) for k in (True, False) if (used & (on == k)).any()}
        warnings, reasons = _judge(motor, log, used, on, parts)
    inputs = (*(() if file.file is None else (file.file,)), *log.files)
    return DriveValidation(
        motor=motor, log=log, on=on, parts=parts, warnings=tuple(warnings), reasons=tuple(reasons), inputs=inputs, command=command
    )  # fmt: skip


def _judge(
    motor: Motor, log: DriveLog, used: Bools, on: Bools, parts: Mapping[bool, Explained]
) -> tuple[list[Remark], list[Remark]]:
    """What is worth knowing, and why the table is not of this log's motor."""
    warnings, reasons = list(log.remarks), list[Remark]()
    name = log.path.name
    whole = explain(motor, log.sweep, used) if len(parts) > 1 else next(iter(parts.values()))
    foreign = all(e.gain < OTHER_GAIN for e in parts.values())
    shift, mirrored, share = best_shift(motor, log.sweep, used)
    if (
        share > TABLE_EXPLAINS
        and whole.alone < SHIFT_BETTER * share
        and (mirrored or abs(shift) > SHIFT_LEAST or foreign)
    ):
        moved, turned = float(np.degrees(shift)), "reversed" if mirrored else None
        alone = max(whole.alone, 0.0)
        reasons.append(
            Remark.of(Code.DRIVE_OTHER_ZERO, share=share, log=name, shift=moved, alone=alone, reversed=turned)
        )
    elif foreign:
        reasons.append(
            Remark.of(Code.DRIVE_OTHER_MOTOR, log=name, gain=max(whole.gain, 0.0), best=max(whole.best, 0.0))
        )
    elif all(e.gain > 1 / OTHER_GAIN for e in parts.values()):
        reasons.append(Remark.of(Code.DRIVE_OTHER_GAIN, log=name, gain=whole.gain))
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
