"""Logs of drives: a data.yaml beside any CSV or text, or a CSV whose headers name their units.

robocal: 1
kind: current                                   # or torque
file: sweep.txt
time: {column: Time, unit: s}
angle: {column: Position, unit: rad}            # rad, deg, turn; count, with the key counts
current: {column: Iq, unit: A}                  # of kind torque: torque: {column: ..., unit: Nm}
flag: {column: Function Activated}              # what the log says of its compensation: 0 off
counts: 8000                                    # of the encoder, per turn of the motor
motor: {name: axis 3, slots: 36, poles: 8, torque_constant: {value: 0.561, unit: Nm/A}}
source: where the log comes from

Without a data file the headers say it: `time [s]`, `angle [rad]`, `current [A]` or `torque [Nm]`. `--columns` says it in words:
`time=Time:s,angle=Position:rad,current=Iq:A`.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, PositiveFloat, PositiveInt

from robocal._record import record
from robocal._types import Array
from robocal.drives.drive_sweep import Sweep, sweep_of
from robocal.errors import FormatError, ModelError, one_of
from robocal.files.csvtable import CsvTable, read_csv
from robocal.files.datamodel import CsvModel, column_model
from robocal.files.schema import FileModel, Name, Version, validate
from robocal.files.text import InputFile
from robocal.files.units import Unit, is_unit, parse_unit
from robocal.files.yamlio import YamlDocument, load
from robocal.remarks.remark import Remark

__all__ = ["DriveLog", "LogMotor", "read_drive_log"]

EFFORTS = {"current": "A", "torque": "N m"}
SI = {"time": "s", "angle": "rad", **EFFORTS}
WORDS = {
    "time": ("time", "t"),
    "angle": ("angle", "position", "theta", "pos"),
    "current": ("current", "iq", "i"),
    "torque": ("torque", "tau"),
    "flag": ("flag", "compensation"),
}
LEAST_ROWS = 100  # grid: of fewer, no order above a few per turn is told
COUNT = "count"
Column = Annotated[Any, BeforeValidator(column_model)]


class ConstantModel(FileModel):
    """A torque constant."""

    value: PositiveFloat
    unit: str


class LogMotorModel(FileModel):
    """What the maker says of the motor."""

    name: Name | None = None
    slots: PositiveInt | None = None
    poles: PositiveInt | None = None
    torque_constant: ConstantModel | None = None


class DriveLogModel(FileModel):
    """data.yaml of a log."""

    robocal: Version
    kind: Literal["current", "torque"]
    file: str
    time: Column
    angle: Column
    current: Column = None
    torque: Column = None
    flag: Column = None
    counts: PositiveInt | None = None
    motor: LogMotorModel = LogMotorModel()
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
    """A log in SI, the files that it was read from, its motor, and the columns that nobody asked for."""

    sweep: Sweep
    path: Path
    files: tuple[InputFile, ...]
    motor: LogMotor
    unread: tuple[str, ...] = ()
    remarks: tuple[Remark, ...] = ()


def read_drive_log(path: str | os.PathLike[str], columns: Sequence[str] = ()) -> DriveLog:
    """Reads a log; `columns` are words such as angle=Position:rad. Raises FileError, FormatError or ModelError."""
    place = Path(path)
    if place.suffix.lower() in (".yaml", ".yml"):
        if columns:
            raise ModelError("the data file names its columns", key="--columns", found=", ".join(columns))
        document = load(place)
        model = validate(DriveLogModel, document)
        table = read_csv(os.path.normpath(place.parent / model.file), **model.csv.style)
        files = (InputFile(place, document.sha256), InputFile(table.path, table.sha256))
        return _read(table, _stated(model, document), model.counts, _motor(model, document), files, place)
    table = read_csv(place)
    own = (InputFile(table.path, table.sha256),)
    return _read(table, _named(columns) if columns else _by_headers(table), None, LogMotor(), own, place)


def _motor(model: DriveLogModel, document: YamlDocument) -> LogMotor:
    told = model.motor
    constant = None
    if told.torque_constant is not None:
        unit = document.unit(told.torque_constant.unit, None, ("motor", "torque_constant", "unit"))
        if unit.si != "N m/A":
            expected = "Nm/A"
            document.fail(
                "not a torque constant", ("motor", "torque_constant", "unit"), found=unit.name, expected=expected
            )
        constant = unit.to_si(told.torque_constant.value)
    if told.poles is not None and told.poles % 2:
        document.fail("poles come in pairs", ("motor", "poles"), found=told.poles, expected="an even number")
    return LogMotor(told.name or "", told.slots, told.poles, constant)


Told = dict[str, tuple[str | int, str | None]]  # what a log holds: column and unit


def _stated(model: DriveLogModel, document: YamlDocument) -> Told:
    other = next(k for k in EFFORTS if k != model.kind)
    document.insist(getattr(model, other) is None, f"a log of kind {model.kind} has no {other}", (other,))
    document.insist(getattr(model, model.kind) is not None, "a key is missing", (model.kind,))
    keys = ("time", "angle", model.kind, "flag")
    told = {k: v for k in keys if (v := getattr(model, k)) is not None}
    return {k: (v.column, v.unit) for k, v in told.items()}


def _named(words: Sequence[str]) -> Told:
    told: Told = {}
    for word in words:
        what, _, rest = word.partition("=")
        column, _, unit = rest.rpartition(":") if ":" in rest else (rest, "", "")
        if what not in WORDS:
            raise ModelError("a log has no such column", key="--columns", found=what, **one_of(what, WORDS))
        if not column:
            raise ModelError("not a column", key="--columns", found=word, expected=f"{what}=COLUMN:UNIT")
        told[what] = (int(column) if column.isdigit() else column, unit or None)
    return told


def _by_headers(table: CsvTable) -> Told:
    told: Told = {}
    for what, words in WORDS.items():
        here = [w for w in words if table.has(w)]
        if len(here) > 1:
            raise table.fail(
                f"two columns may be the {what}", column=here[1], found=" and ".join(here), expected="--columns"
            )
        if here:
            told[what] = (here[0], None)
    return told


def _read(
    table: CsvTable, told: Told, counts: int | None, motor: LogMotor, files: tuple[InputFile, ...], place: Path
) -> DriveLog:
    kinds = [k for k in EFFORTS if k in told]
    if len(kinds) != 1:
        words = "torque and current: one of them is the effort" if kinds else "no column is a current or a torque"
        expected = "current [A] or torque [Nm] in the header, a data.yaml, or --columns current=COLUMN:A"
        raise table.fail(words, found=", ".join(n for n in table.names if n), expected=expected)
    kind = kinds[0]
    for what in ("time", "angle"):
        if what not in told:
            expected = f"{what} [{SI[what]}] in the header, a data.yaml, or --columns {what}=COLUMN:{SI[what]}"
            raise table.fail(
                f"no column is the {what}", found=", ".join(n for n in table.names if n), expected=expected
            )
    values: Mapping[str, Array] = {what: _values(table, what, *told[what], counts) for what in ("time", "angle", kind)}
    flag = table.numbers([told["flag"][0]])[:, 0] if "flag" in told else None
    if len(table) < LEAST_ROWS:
        raise FormatError("a log of too few rows", file=table.path, found=len(table), expected=f"at least {LEAST_ROWS}")
    step = np.diff(values["time"])
    if (step < 0).any():
        at = int(np.flatnonzero(step < 0)[0]) + 1
        raise table.fail(
            "time runs backwards", at, told["time"][0], found=float(values["time"][at]), expected="later rows below"
        )
    if not step.any():
        raise table.fail("time stands still", column=told["time"][0], expected="the moment of every row")
    for what in ("angle", kind):
        if not np.ptp(values[what]):
            raise table.fail(
                f"the {what} never changes", column=told[what][0], found=float(values[what][0]), expected=MOVES[what]
            )
    name = motor.name or place.stem
    sweep = sweep_of(name, EFFORTS[kind], values["time"], values["angle"], values[kind], flag, table.lines)
    if not sweep.direction.any():
        raise table.fail(
            "the angle goes nowhere", column=told["angle"][0], expected="a sweep over a turn, in both directions"
        )
    return DriveLog(sweep, place, files, motor, table.unread(), table.remarks)


MOVES = {
    "angle": "a sweep over a turn, in both directions",
    "current": "what the drive asks",
    "torque": "what the drive asks",
}


def _values(table: CsvTable, what: str, column: str | int, unit: str | None, counts: int | None) -> Array:
    """One column in SI. Raises FormatError."""
    stated = table.unit(column)
    name = unit or stated
    if name is None:
        example = "rad" if what == "angle" else SI[what].replace(" ", "")
        expected = f"{what} [{example}] in the header, or unit: {example} in a data.yaml"
        raise table.fail(f"the unit of the {what} is not named", column=column, expected=expected)
    if unit is not None and stated is not None and not _same(unit, stated):
        raise table.fail("the header states another unit than was asked", column=column, found=stated, expected=unit)
    values = table.numbers([column])[:, 0]
    if name in (COUNT, "counts", "steps"):
        if what != "angle" or counts is None:
            expected = "rad, deg or turn; or the key counts, how many make a turn"
            raise table.fail("encoder counts say no angle", column=column, found=name, expected=expected)
        return np.asarray(values * 2 * np.pi / counts)
    known: Unit = parse_unit(name, SI[what], file=table.path, column=column)
    if what == "angle" and _counted(values):
        found = f"whole numbers up to {np.abs(values).max():.0f}"
        raise table.fail(
            "the angle looks like encoder counts", column=column, found=found, expected="unit: count, with counts: N"
        )
    return np.asarray(known.to_si(values))


def _same(one: str, other: str) -> bool:
    """Whether two names are of one unit, as deg and the sign of degrees."""
    known = is_unit(one) and is_unit(other)
    return one == other or (known and parse_unit(one).name == parse_unit(other).name)


def _counted(values: Array) -> bool:
    """Whether angles are whole numbers, so many that they can only be counted."""
    return bool(
        (values == np.round(values)).all() and len(np.unique(values)) > 720
    )  # grid: a log in whole degrees has 360 a turn
