"""Tables that compensate cogging, in the forms that controllers take, and read back from them bit for bit.

csv        angle [deg], forward, reverse; comment lines say how to look up
json       the same as lists, with unit and rules
c          a C header: int16 for each direction, and the scale that multiplies them
c-float    a C header of floats
odrive     the 3600 numbers of `controller.config.anticogging.cogging_map` of firmware 0.5, N m: one curve for both directions
array      two columns of numbers, forward and reverse, nothing else

Cell i of N holds the curve at i 360/N deg from the encoder's index, positive the way that the angle grows; `odrive` looks up by cutting
off, so that its cell i holds the curve at its middle. What is written is read again and compared before it is handed over.
Source: firmware 0.5 of ODrive, Controller::anticogging_calibration and update.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.diagnose.drive_limits import CELLS_LOSE, SWEEP_EFFORT
from robocal.errors import FormatError, look_up
from robocal.files.motor_file import MotorFile

__all__ = ["FORMS", "CompensationTable", "compensation_table", "read_table", "table_text"]

ODRIVE_CELLS = 3600
FINER = 8  # grid: places within a cell, at which its line is compared
INT16 = 32767
LOOK = 720  # grid: cells, by which the size of a curve is told
FLOAT32 = 3e38  # grid: the largest number of four bytes
RULES = (
    "add the value to the command: it is what the rotor asks for at this angle",
    "angle: of the motor, from the encoder's index, as in the log; wrap it to one turn",
    "look up by the setpoint of the angle where the motor follows it; by the measured angle where it does not",
    "direction: the one that is desired, also at standstill, never the sign of the measured speed",
)


@record(eq=False)
class CompensationTable:
    """Values (2, N) for forward and reverse, or (1, N) for both, in a unit, and whether friction is in them."""

    values: Array
    unit: str
    friction: bool
    motor: str
    constant: float | None = None
    scale: float = 1.0  # of the form c
    proven: bool = True  # whether the motor's own logs prove it


def compensation_table(
    motor: MotorFile, form: str, cells: int, unit: str | None, friction: bool, constant: float | None
) -> CompensationTable:
    """The table of a motor as a form holds it, numbers as coarse as the form's. Raises FormatError where the torque constant lacks."""
    if form == "odrive":
        _check_odrive(cells, unit, friction)
    k_c = constant if constant is not None else motor.torque_constant
    own = motor.unit.replace(" ", "")
    wanted = "Nm" if form == "odrive" else unit or own
    factor = 1.0
    if wanted != own:
        if k_c is None:
            expected = "--torque-constant, in Nm/A, or torque_constant in the log's data file"
            raise FormatError(
                "torque and current are told apart by a torque constant", key="torque_constant", expected=expected
            )
        factor = k_c if wanted == "Nm" else 1 / k_c
    if form == "odrive":
        # Its look-up cuts off: the middle of a cell is where it is right on average.
        fine = motor.curves(2 * ODRIVE_CELLS)[:, 1::2]
        values = fine.mean(axis=0, keepdims=True) * factor
    else:
        _check_cells(motor, cells)
        values = motor.curves(cells) * factor
        if friction:
            values = values + factor * motor.coulomb * np.array([[1.0], [-1.0]])
    largest = float(np.abs(values).max())
    if not largest < FLOAT32:
        message = "values that no controller holds: the torque constant is of another unit"
        raise FormatError(message, key="torque_constant", found=k_c, expected="in Nm/A")
    if wanted != own and k_c is not None:
        _check_constant(motor, k_c, factor, "N m" if wanted == "Nm" else wanted)
    scale = _scale(values) if form == "c" else 1.0
    proven = motor.verdict in ("", "improved")
    return CompensationTable(_round(values, form, scale), wanted, friction, motor.name, k_c, scale, proven)


def _check_constant(motor: MotorFile, k_c: float, factor: float, unit: str) -> None:
    """Efforts that a motor may have in its own unit, and that none has in the other. Raises FormatError."""

    def within(size: float, unit: str) -> bool:
        return SWEEP_EFFORT[f"{unit} least"] <= size <= SWEEP_EFFORT[f"{unit} most"]

    size = float(np.abs(motor.curves(LOOK)).max()) + abs(motor.coulomb)
    if within(size, motor.unit) and not within(size * factor, unit):
        found = f"{k_c:g}, with which cogging and friction are {size * factor:.3g} {unit}"
        raise FormatError("no motor has this torque constant", key="torque_constant", found=found, expected="in Nm/A")


def _check_odrive(cells: int, unit: str | None, friction: bool) -> None:
    """What its map cannot be. Raises FormatError."""
    message = "the map of odrive has one form"
    if cells != ODRIVE_CELLS:
        raise FormatError(message, key="--cells", found=cells, expected=str(ODRIVE_CELLS))
    if unit == "A":
        raise FormatError(message, key="--unit", found=unit, expected="Nm")
    if friction:
        raise FormatError("one curve for both directions has no friction", key="--friction", expected="another form")


def _check_cells(motor: MotorFile, cells: int) -> None:
    """Whether lines from cell to cell keep the curve. Raises FormatError."""
    fine = motor.curves(FINER * cells)
    ends = np.concatenate([fine[:, ::FINER], fine[:, :1]], axis=1)
    at = np.arange(FINER * cells) / FINER
    left = fine - np.array([np.interp(at, np.arange(cells + 1), row) for row in ends])
    lost = float(np.sum(left**2) / max(float(np.sum((fine - fine.mean()) ** 2)), 1e-300))
    if lost > CELLS_LOSE:
        needed = f"at least {8 * max(motor.cogging.orders, default=1)}" if motor.table is None else "more cells"
        raise FormatError(f"so few cells lose {lost:.0%} of the curve", key="--cells", found=cells, expected=needed)


def _scale(values: Array) -> float:
    return float(np.abs(values).max() / INT16) or 1.0


def _round(values: Array, form: str, scale: float) -> Array:
    """The values as the form holds them."""
    if form == "c":
        return np.asarray(np.rint(values / scale).astype(np.int64) * scale)
    if form in ("c-float", "odrive"):
        return values.astype(np.float32).astype(float)
    return values


def _rules(table: CompensationTable) -> list[str]:
    said = "friction is in the values: + forward, - reverse" if table.friction else "friction is not in the values"
    own = [] if table.proven else ["NOT PROVEN: robocal drive identify did not call this motor improved"]
    own += [f"unit: {table.unit}", said]
    if table.constant is not None:
        own.append(f"torque constant: {table.constant!r} Nm/A; current is torque divided by it")
    return [*own, *(RULES if len(table.values) > 1 else RULES[:-1])]


# --- forms ------------------------------------------------------------------------------------------------------------------


def _csv(table: CompensationTable) -> str:
    count = table.values.shape[1]
    unit = table.unit
    lines = [f"# {line}" for line in (f"cogging of {_plain(table.motor)}", *_rules(table))]
    lines.append(f"angle [deg],forward [{unit}],reverse [{unit}]")
    forward, reverse = table.values.tolist()
    lines += [f"{360 * i / count!r},{a!r},{b!r}" for i, (a, b) in enumerate(zip(forward, reverse, strict=True))]
    return "\n".join(lines) + "\n"


def _read_csv(text: str) -> Array:
    rows = [line.split(",") for line in text.splitlines() if line and not line.startswith("#")][1:]
    return np.array([[float(r[1]), float(r[2])] for r in rows]).T


def _json(table: CompensationTable) -> str:
    forward, reverse = table.values.tolist()
    document = {
        "kind": "cogging-table", "motor": table.motor, "unit": table.unit, "cells": table.values.shape[1], "friction": table.friction,
        "rules": _rules(table), "forward": forward, "reverse": reverse,
    }  # fmt: skip
    return json.dumps(document, indent=1) + "\n"


def _read_json(text: str) -> Array:
    found = json.loads(text)
    return np.array([found["forward"], found["reverse"]])


def _header(table: CompensationTable, lines: Sequence[str]) -> str:
    comments = "\n".join(f" * {line}" for line in (f"cogging of {_plain(table.motor)}", *_rules(table)))
    count = table.values.shape[1]
    start = f"/*\n{comments}\n */\n#ifndef COGGING_TABLE_H\n#define COGGING_TABLE_H\n#include <stdint.h>\n\n#define COGGING_CELLS {count}\n"
    return start + "\n".join(lines) + "\n\n#endif\n"


def _plain(name: str) -> str:
    return re.sub(r"[^\w .-]", "_", name)


def _c(table: CompensationTable) -> str:
    ints = np.rint(table.values / table.scale).astype(np.int64)
    lines = [f"#define COGGING_SCALE {table.scale!r} /* {table.unit} for one */"]
    for word, row in zip(("forward", "reverse"), ints.tolist(), strict=True):
        lines.append(f"static const int16_t cogging_{word}[COGGING_CELLS] = {{{', '.join(map(str, row))}}};")
    return _header(table, lines)


def _read_c(text: str) -> Array:
    scale = re.search(r"COGGING_SCALE (\S+)", text)
    if scale is None:
        raise FormatError("no table of cogging", key="COGGING_SCALE", expected="a header of robocal drive compensate")
    return np.asarray(np.array(_braces(text, int)) * float(scale[1]))


def _c_float(table: CompensationTable) -> str:
    lines = []
    for word, row in zip(("forward", "reverse"), table.values.tolist(), strict=True):
        cells = ", ".join(f"{v:.9g}" + ("f" if "." in f"{v:.9g}" or "e" in f"{v:.9g}" else ".0f") for v in row)
        lines.append(f"static const float cogging_{word}[COGGING_CELLS] = {{{cells}}};")
    return _header(table, lines)


def _read_c_float(text: str) -> Array:
    return np.array(_braces(text, lambda v: float(np.float32(v.rstrip("f")))))


def _braces(text: str, number: Callable[[str], float]) -> list[list[float]]:
    return [[number(v.strip()) for v in row.split(",")] for row in re.findall(r"\{([^}]*)\}", text)]


def _odrive(table: CompensationTable) -> str:
    document = {
        "kind": "odrive-cogging-map", "motor": table.motor, "firmware": "0.5", "unit": "Nm",
        "rules": [*_rules(table), "one curve for both directions: the mean; the encoder needs its index, or is absolute"],
        "cogging_map": [float(f"{v:.9g}") for v in table.values[0].tolist()],
    }  # fmt: skip
    return json.dumps(document, indent=1) + "\n"


def _read_odrive(text: str) -> Array:
    return np.array([json.loads(text)["cogging_map"]], dtype=np.float32).astype(float)


def _array(table: CompensationTable) -> str:
    return "".join(f"{a!r} {b!r}\n" for a, b in table.values.T.tolist())


def _read_array(text: str) -> Array:
    return np.array([[float(v) for v in line.split()] for line in text.splitlines()]).T


Form = tuple[Callable[[CompensationTable], str], Callable[[str], Array]]
FORMS: dict[str, Form] = {
    "csv": (_csv, _read_csv),
    "json": (_json, _read_json),
    "c": (_c, _read_c),
    "c-float": (_c_float, _read_c_float),
    "odrive": (_odrive, _read_odrive),
    "array": (_array, _read_array),
}


def table_text(table: CompensationTable, form: str) -> str:
    """The text of a table in a form. Raises ModelError for an unknown one."""
    text = look_up(FORMS, form, "no such form of a table", "--format")[0](table)
    back = read_table(text, form)
    if back.shape != table.values.shape or not (back == table.values).all():
        raise FormatError("the table that was written reads otherwise", key="--format", found=form)
    return text


def read_table(text: str, form: str) -> Array:
    """The values (2, N), or (1, N) of `odrive`, that a text holds."""
    return look_up(FORMS, form, "no such form of a table", "--format")[1](text)
