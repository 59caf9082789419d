"""Logs of drives: a data.yaml beside any CSV or text, or a CSV whose headers name their units.

robocal: 1
kind: current                                   # or torque
file: sweep.txt
time: {column: Time, unit: s}
angle: {column: Position, unit: rad}            # rad, deg, turn; count, with the key counts
current: {column: Iq, unit: A}                  # of kind torque: torque: {column: ..., unit: Nm}
flag: {column: Function Activated}              # what the log says of its compensation: 0 off
counts: 8000                                    # of the encoder, per turn of the motor
load: detached                                  # or loaded
motor: {name: axis 3, slots: 36, poles: 8, torque_constant: {value: 0.561, unit: Nm/A}}
motors: [{name: left, angle: {...}, current: {...}}, ...]       # in place of motor, angle and current: several in one file
source: where the log comes from

Without a data file the headers say it: `time [s]`, `angle [rad]`, `current [A]` or `torque [Nm]`. `--columns` says it in words:
`time=Time:s,angle=Position:rad,current=Iq:A`. `drive_columns` has the rest of it.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BeforeValidator, Field, PositiveFloat, PositiveInt

from robocal._record import record, replace
from robocal._types import Array
from robocal.drives.drive_sweep import Sweep, sweep_of
from robocal.drives.log_rows import join_restarts, repeated_rows, restarts
from robocal.errors import FormatError, ModelError
from robocal.files.csvtable import CsvTable, read_csv
from robocal.files.datamodel import CsvModel, column_model
from robocal.files.drive_columns import EFFORTS, SI, ColumnMap, by_headers, insist_known, named
from robocal.files.schema import FileModel, Name, Version, validate
from robocal.files.text import InputFile
from robocal.files.units import Unit, is_unit, parse_unit
from robocal.files.yamlio import YamlDocument, load
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["DriveLog", "LogMotor", "read_drive_log", "read_drive_logs"]

LEAST_ROWS = 100  # grid: of fewer, no order above a few per turn is told
COUNT = "count"
Column = Annotated[Any, BeforeValidator(column_model)]


class ConstantModel(FileModel):
    """A torque constant."""

    value: PositiveFloat
    unit: str


class LogMotorModel(FileModel):
    """What the maker says of the motor; of several in one file, its own columns."""

    name: Name | None = None
    slots: Annotated[int, Field(ge=1, le=1000)] | None = None
    poles: Annotated[int, Field(ge=2, le=1000)] | None = None
    torque_constant: ConstantModel | None = None


class ColumnsMotorModel(LogMotorModel):
    """One of several motors of a file: its own columns."""

    name: Name
    angle: Column
    current: Column = None
    torque: Column = None
    flag: Column = None


class DriveLogModel(FileModel):
    """data.yaml of a log."""

    robocal: Version
    kind: Literal["current", "torque"]
    file: str
    time: Column
    angle: Column = None
    current: Column = None
    torque: Column = None
    flag: Column = None
    counts: PositiveInt | None = None
    load: Literal["detached", "loaded"] | None = None
    motor: LogMotorModel = LogMotorModel()
    motors: list[ColumnsMotorModel] = Field(default_factory=list)
    csv: CsvModel = CsvModel()
    source: str = ""


@record
class LogMotor:
    """What a log's file says of its motor; the torque constant in N m/A."""

    name: str = ""
    slots: int | None = None
    poles: int | None = None
    torque_constant: float | None = None


@record(eq=False)
class DriveLog:
    """A log in SI, the files that it was read from, its motor, the columns that nobody asked for, the unit in which its angle is written,
    and whether it has a load, where it says so."""

    sweep: Sweep
    path: Path
    files: tuple[InputFile, ...]
    motor: LogMotor
    unread: tuple[str, ...] = ()
    remarks: tuple[Remark, ...] = ()
    angle_unit: str = "rad"
    load: str | None = None

    def with_load(self, loaded: bool) -> DriveLog:
        """The same with a load, where it is said to have one and its file does not say otherwise."""
        if not loaded or self.load is not None:
            return self
        return replace(self, load="loaded", sweep=replace(self.sweep, loaded=True))

    @property
    def speed_unit(self) -> str:
        """The unit in which people ask for its speed."""
        return f"{self.angle_unit}/s"

    def in_angle_unit(self, radians: ArrayLike) -> Array:
        """Angles or speeds (...) in the unit of the log."""
        return np.asarray(parse_unit(self.angle_unit, "rad").from_si(np.asarray(radians, float)))


def read_drive_logs(path: str | os.PathLike[str], columns: Sequence[str] = ()) -> tuple[DriveLog, ...]:
    """Reads a log, which may be of several motors; `columns` are words such as angle=Position:rad. Raises FileError, FormatError or
    ModelError."""
    place = Path(path)
    if place.suffix.lower() in (".yaml", ".yml"):
        if columns:
            raise ModelError("the data file names its columns", key="--columns", found=", ".join(columns))
        document = load(place)
        model = validate(DriveLogModel, document)
        table = read_csv(os.path.normpath(place.parent / model.file), **model.csv.style)
        files = (InputFile(place, document.sha256), InputFile(table.path, table.sha256))
        each = _stated(model, document)
        return tuple(_read(table, told, model.counts, motor, files, place, model.load) for told, motor in each)
    table = read_csv(place)
    own = (InputFile(table.path, table.sha256),)
    by_motor = named(columns) if columns else by_headers(table)
    return tuple(_read(table, told, None, LogMotor(name), own, place, None) for name, told in by_motor.items())


def read_drive_log(path: str | os.PathLike[str], columns: Sequence[str] = ()) -> DriveLog:
    """Reads the log of one motor. Raises FileError, FormatError or ModelError."""
    logs = read_drive_logs(path, columns)
    if len(logs) > 1:
        found = ", ".join(log.motor.name for log in logs)
        expected = "--columns that name those of one motor"
        raise ModelError("the file has several motors", key=str(path), found=found, expected=expected)
    return logs[0]


def _motor(told: LogMotorModel, document: YamlDocument, at: tuple[str | int, ...]) -> LogMotor:
    constant = None
    if told.torque_constant is not None:
        unit = document.unit(told.torque_constant.unit, None, (*at, "torque_constant", "unit"))
        if unit.si != "N m/A":
            expected = "Nm/A"
            document.fail("not a torque constant", (*at, "torque_constant", "unit"), found=unit.name, expected=expected)
        constant = unit.to_si(told.torque_constant.value)
    if told.poles is not None and told.poles % 2:
        document.fail("poles come in pairs", (*at, "poles"), found=told.poles, expected="an even number")
    return LogMotor(told.name or "", told.slots, told.poles, constant)


def _stated(model: DriveLogModel, document: YamlDocument) -> list[tuple[ColumnMap, LogMotor]]:
    """The columns of each motor of a data file."""
    other = next(k for k in EFFORTS if k != model.kind)
    if not model.motors:
        return [(_columns(model, model, other, document, ()), _motor(model.motor, document, ("motor",)))]
    document.insist(model.angle is None, "each of several motors has its own angle", ("angle",))
    names = [m.name for m in model.motors]
    document.insist(len(set(names)) == len(names), "two motors have one name", ("motors",), found=", ".join(names))
    out = []
    for i, motor in enumerate(model.motors):
        at = ("motors", i)
        out.append((_columns(model, motor, other, document, at), _motor(motor, document, at)))
    return out


def _columns(
    model: DriveLogModel,
    own: DriveLogModel | ColumnsMotorModel,
    other: str,
    document: YamlDocument,
    at: tuple[str | int, ...],
) -> ColumnMap:
    document.insist(getattr(own, other) is None, f"a log of kind {model.kind} has no {other}", (*at, other))
    for key in ("angle", model.kind):
        document.insist(getattr(own, key) is not None, "a key is missing", (*at, key))
    told = {
        "time": model.time,
        "angle": own.angle,
        model.kind: getattr(own, model.kind),
        "flag": own.flag or model.flag,
    }
    return {k: (v.column, v.unit) for k, v in told.items() if v is not None}


def _read(
    table: CsvTable,
    told: ColumnMap,
    counts: int | None,
    motor: LogMotor,
    files: tuple[InputFile, ...],
    place: Path,
    load: str | None,
) -> DriveLog:
    insist_known(table, told)
    kind = next(k for k in EFFORTS if k in told)
    read = {what: _values(table, what, *told[what], counts) for what in ("time", "angle", kind)}
    values: Mapping[str, Array] = {what: v for what, (v, _) in read.items()}
    flag = table.numbers([told["flag"][0]])[:, 0] if "flag" in told else None
    if len(table) < LEAST_ROWS:
        raise FormatError("a log of too few rows", file=table.path, found=len(table), expected=f"at least {LEAST_ROWS}")
    time, remarks = values["time"], list(table.remarks)
    name = motor.name or place.stem
    starts = restarts(time, LEAST_ROWS)
    if starts is None:
        at = int(np.flatnonzero(np.diff(time) < 0)[0]) + 1
        grows = [what for what in ("angle", kind) if np.ptp(values[what]) and (np.diff(values[what]) >= 0).all()]
        hint = f"; the {grows[0]} never falls: these columns may be exchanged" if grows else ""
        expected = f"later rows below{hint}"
        raise table.fail("time runs backwards", at, told["time"][0], found=float(time[at]), expected=expected)
    if not np.diff(time).any():
        raise table.fail("time stands still", column=told["time"][0], expected="the moment of every row")
    for what in ("angle", kind):
        if not np.ptp(values[what]):
            raise table.fail(
                f"the {what} never changes", column=told[what][0], found=float(values[what][0]), expected=MOVES[what]
            )
    if len(starts):
        parts = np.split(values[kind], starts)
        twice = next((i for i, p in enumerate(parts) if any(np.array_equal(p, o) for o in parts[:i])), None)
        if twice is not None:
            at = int(starts[twice - 1])
            raise table.fail(
                "a sweep stands here twice", at, told["time"][0], expected="every sweep once: twice it counts twice"
            )
        time = join_restarts(time, values["angle"], starts)
        lines = ", ".join(str(int(table.lines[i])) for i in starts)
        remarks.append(Remark.of(Code.DRIVE_TIME_ANEW, log=name, lines=lines, count=len(starts) + 1))
    again = repeated_rows(values["angle"], values[kind])
    if again.any():
        remarks.append(Remark.of(Code.DRIVE_REPEATED_ROWS, count=int(again.sum()), log=name))
    sweep = sweep_of(name, EFFORTS[kind], time, values["angle"], values[kind], flag, table.lines, again)
    if not sweep.direction.any():
        raise table.fail(
            "the angle goes nowhere", column=told["angle"][0], expected="a sweep over a turn, in both directions"
        )
    sweep = replace(sweep, loaded=load == "loaded")
    return DriveLog(sweep, place, files, motor, table.unread(), tuple(remarks), read["angle"][1], load)


MOVES = {
    "angle": "a sweep over a turn, in both directions",
    "current": "what the drive asks",
    "torque": "what the drive asks",
}


def _values(table: CsvTable, what: str, column: str | int, unit: str | None, counts: int | None) -> tuple[Array, str]:
    """One column in SI, and the unit in which it is written; of counts deg. Raises FormatError."""
    stated = table.unit(column)
    name = unit or stated
    assert name is not None  # `insist_known` has seen to it
    if unit is not None and stated is not None and not _same(unit, stated):
        raise table.fail("the header states another unit than was asked", column=column, found=stated, expected=unit)
    values = table.numbers([column])[:, 0]
    if name in (COUNT, "counts", "steps"):
        if what != "angle" or counts is None:
            expected = "rad, deg or turn; or the key counts, how many make a turn"
            raise table.fail("encoder counts say no angle", column=column, found=name, expected=expected)
        return np.asarray(values * 2 * np.pi / counts), "deg"
    known: Unit = parse_unit(name, SI[what], file=table.path, column=column)
    if what == "angle" and _counted(values):
        found = f"whole numbers up to {np.abs(values).max():.0f}"
        raise table.fail(
            "the angle looks like encoder counts", column=column, found=found, expected="unit: count, with counts: N"
        )
    return np.asarray(known.to_si(values)), known.name


def _same(one: str, other: str) -> bool:
    """Whether two names are of one unit, as deg and the sign of degrees."""
    known = is_unit(one) and is_unit(other)
    return one == other or (known and parse_unit(one).name == parse_unit(other).name)


def _counted(values: Array) -> bool:
    """Whether angles are whole numbers, so many that they can only be counted."""
    return bool(
        (values == np.round(values)).all() and len(np.unique(values)) > 720
    )  # grid: a log in whole degrees has 360 a turn
