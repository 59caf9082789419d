"""Robots that a program opens, and measurements that it holds.

Arrays become the text of a table that describes itself, and are read, doubted and judged as a file would be, so that both
ways give the same numbers.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robocal._record import record
from robocal._types import Array
from robocal.errors import FileError, FormatError, ModelError, nearest
from robocal.files.robot import Robot
from robocal.files.text import MemoryFile
from robocal.files.units import UNITS
from robocal.session.inputs import open_arm

__all__ = ["Arm", "Measurements", "measurements", "robot", "table"]

Data = str | os.PathLike[str]
NAME = "measurements"  # what messages call arrays; their rows are counted from 2, as in a table with a header


@record
class Arm:
    """A robot as it was opened: its name or file, the links of a URDF, and the model in SI (`model.chain`)."""

    opened: str
    base: str | None
    tip: str | None
    model: Robot

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints from base to tool."""
        return self.model.chain.joint_names

    def pose(self, joints: ArrayLike) -> Array:
        """Tool poses in base coordinates, (m, 4, 4) in m, at joint values (m, n) in rad or m."""
        return self.model.chain.pose(joints)

    def __repr__(self) -> str:
        free = len(self.model.chain.table.free)
        return f"{self.model.name}: {len(self.joints)} joints, {self.model.convention}, {free} parameters to identify"


def robot(name: Data, *, base: str | None = None, tip: str | None = None) -> Arm:
    """A robot from the catalogue ("ur10"), a robot.yaml, a URDF (from link `base` to `tip`) or a run folder.

    Raises InputError.
    """
    opened = path(name)
    return Arm(opened, base, tip, open_arm(opened, base=base, tip=tip))


def path(name: Data) -> str:
    """A name or path as text. Raises ModelError for anything else."""
    if not isinstance(name, str | os.PathLike):
        raise ModelError(
            "this names no robot", found=type(name).__name__, expected="a name of the catalogue, or a path"
        )
    return os.fspath(name)


@record
class Measurements:
    """Measurements that a program holds, as the text of a table whose headers say units."""

    text: str

    @property
    def file(self) -> MemoryFile:
        """The same as a file to read."""
        return MemoryFile.of(NAME, self.text)

    def save(self, path: Data) -> Path:
        """Writes the table as a CSV that `robocal identify` reads. Raises FileError where one exists."""
        place = Path(path)
        if place.exists():
            raise FileError("there is a file already", file=place, expected="a new name")
        from robocal.files.writing import write_text

        write_text(place, self.text)
        return place

    def __repr__(self) -> str:
        lines = self.text.splitlines()
        return f"Measurements: {len(lines) - 1} rows of {lines[0]}"


def measurements(
    joints: ArrayLike,
    *,
    position: ArrayLike,
    rotation_vector: ArrayLike | None = None,
    units: tuple[str, str] | tuple[str, str, str] = ("rad", "m"),
    sigma: ArrayLike | None = None,
    turn_sigma: ArrayLike | None = None,
    columns: Mapping[str, ArrayLike] | None = None,
) -> Measurements:
    """Measured positions or poses of the tool at joint values, from arrays or anything that numpy reads as one.

    joints (m, n) in the first of `units`; position (m, 3) in the second; rotation_vector (m, 3), for full poses, in the
    third (rad, unless it is given). sigma is the standard deviation of each coordinate in the unit of the position: a number,
    (3,) or (m, 3); turn_sigma the same of the rotations. `columns` are further ones (m,) by header: "temperature [degC]",
    "group". Raises FormatError for shapes, units or numbers that make no sense.
    """
    if isinstance(units, str) or len(units) not in (2, 3):
        raise FormatError("units are said one by one", column="units", found=units, expected='("deg", "mm")')
    q, p = _numbers(joints, "joints"), _numbers(position, "position", 3)
    turn = units[2] if len(units) > 2 else "rad"
    table = {f"q{i + 1} [{_unit(units[0], 'rad', 'm')}]": q[:, i] for i in range(q.shape[1])}
    table |= _three("", p, _unit(units[1], "m"), len(q), "position")
    if sigma is not None:
        table |= _three("s", _spread(sigma, len(q), "sigma"), units[1], len(q), "sigma")
    if rotation_vector is not None:
        r = _numbers(rotation_vector, "rotation_vector", 3)
        table |= _three("r", r, _unit(turn, "rad"), len(q), "rotation_vector")
        if turn_sigma is not None:
            table |= _three("sr", _spread(turn_sigma, len(q), "turn_sigma"), turn, len(q), "turn_sigma")
    elif turn_sigma is not None:
        message = "rotations that were not given have no sigma"
        raise FormatError(message, column="turn_sigma", expected="rotation_vector")
    for name, values in (columns or {}).items():
        given = np.asarray(values)
        if given.shape != (len(q),):
            raise FormatError("wrong shape", column=name, found=given.shape, expected=f"({len(q)},)")
        if name in table:
            raise FormatError("this column stands there already", column=name, expected="another header")
        table[name] = given
    return Measurements(_text(table))


def table(columns: Mapping[str, ArrayLike] | Any) -> Measurements:
    """A table as a file would hold it: columns (m,) by headers that carry units ("q1 [deg]", "x [mm]"), from a mapping or a
    data frame (anything with `__dataframe__`: pandas, polars, pyarrow). Raises FormatError for columns of different lengths."""
    if not isinstance(columns, Mapping):
        if not hasattr(columns, "__dataframe__"):
            expected = "a data frame, or a mapping of columns by header"
            raise FormatError("this is no table", found=type(columns).__name__, expected=expected)
        names = list(columns.__dataframe__().column_names())
        if (twice := next((n for n in names if names.count(n) > 1), None)) is not None:
            raise FormatError("two columns have this header", column=str(twice), expected="each header once")
        columns = {str(name): columns[name] for name in names}
    found = {str(k): _require_unmasked(v, str(k)) for k, v in columns.items()}
    lengths = {v.shape for v in found.values()}
    if len(lengths) != 1 or len(next(iter(lengths))) != 1:
        shapes = ", ".join(f"{k}: {v.shape}" for k, v in found.items())
        raise FormatError("columns of different lengths", found=shapes, expected="(m,) each")
    return Measurements(_text(found))


def _unit(name: str, *dimensions: str) -> str:
    """The name of a unit. Raises FormatError for none, or for one of another dimension."""
    good = [n for n, u in UNITS.items() if u.si in dimensions]
    if name not in good:
        word = "a unit of something else" if name in UNITS else "unknown unit"
        raise FormatError(word, found=name, expected=", ".join(good), suggestion=nearest(name, good))
    return name


def _require_unmasked(given: ArrayLike, name: str) -> NDArray[Any]:
    """An array. Raises FormatError where values are masked: what nobody read is no measurement."""
    if np.ma.is_masked(given):
        raise FormatError("some values are masked", column=name, expected="the rows that were measured, or NaN")
    return np.asarray(given)


def _numbers(given: ArrayLike, name: str, width: int | None = None) -> Array:
    """Finite numbers (m, width). Raises FormatError."""
    try:
        out = _require_unmasked(given, name).astype(float, casting="same_kind" if np.iscomplexobj(given) else "unsafe")
    except (TypeError, ValueError):
        raise FormatError("these are no numbers", column=name, expected="an array (m, n)") from None
    if out.ndim != 2 or (width is not None and out.shape[1] != width):
        raise FormatError("wrong shape", column=name, found=out.shape, expected=f"(m, {width or 'n'})")
    return out


def _spread(given: ArrayLike, rows: int, name: str) -> Array:
    """Standard deviations (m, 3) from a number, (3,) or (m, 3)."""
    try:
        return np.broadcast_to(_require_unmasked(given, name).astype(float), (rows, 3))
    except (TypeError, ValueError):
        expected = f"a number, (3,) or ({rows}, 3)"
        raise FormatError("wrong shape", column=name, found=np.shape(given), expected=expected) from None


def _three(stem: str, values: Array, unit: str, rows: int, what: str) -> dict[str, Array]:
    if len(values) != rows:
        raise FormatError("wrong number of rows", column=what, found=len(values), expected=f"{rows}, as many as joints")
    return {f"{stem}{axis} [{unit}]": values[:, i] for i, axis in enumerate("xyz")}


def _text(table: Mapping[str, NDArray[Any]]) -> str:
    """The table as CSV, every number with all of its digits."""
    from robocal.files.csvtext import csv_text

    rows = zip(*(c.tolist() for c in table.values()), strict=True)
    return csv_text(
        tuple(table), [[repr(float(v)) if isinstance(v, float | np.floating) else v for v in r] for r in rows]
    )
