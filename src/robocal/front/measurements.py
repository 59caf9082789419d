"""Measurements that a program holds.

Arrays become the text of a table that describes itself, and are read, doubted and judged as a file would be, so that both ways give the
same numbers.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robocal._record import record
from robocal._types import Array
from robocal.errors import FileError, FormatError, InputError
from robocal.files.text import MemoryFile
from robocal.files.units import UNITS
from robocal.front import shapes
from robocal.front.arguments import named_arguments
from robocal.geometry import so3

__all__ = ["Measurements", "locate_array", "measurements", "table"]

NAME = "measurements"  # what messages call arrays; their rows are counted from 2, as in a table with a header
LENGTHS = "lengths"  # and those of cables, beside poses
TURNS = ("pose", "rotation", "quaternion", "rotation_vector")  # arguments that say how the tool is turned


@record
class Measurements:
    """Measurements that a program holds, as the text of a table whose headers say units; of a cable robot also that of its lengths.

    `of` is joints or lengths; of any other table it says nothing."""

    text: str
    lengths: str = ""
    of: str = ""

    @property
    def file(self) -> MemoryFile:
        """The same as a file to read."""
        return MemoryFile.of(NAME if self.of != LENGTHS or self.lengths else LENGTHS, self.text)

    @property
    def files(self) -> tuple[MemoryFile, ...]:
        """Every table as a file to read: of a cable robot lengths and poses."""
        return (*([MemoryFile.of(LENGTHS, self.lengths)] if self.lengths else []), self.file)

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of all columns, without units."""
        heads = [t.partition("\n")[0].split(",") for t in (self.lengths, self.text) if t]
        return tuple(h.partition(" [")[0] for head in heads for h in head)

    @property
    def moved(self) -> tuple[str, ...]:
        """The names of the columns of joints or lengths."""
        if self.of == "joints":
            return tuple(c for c in self.columns if c[:1] == "q" and c[1:].isdigit())
        own = (self.lengths or self.text).partition("\n")[0].split(",") if self.of else []
        return tuple(h.partition(" [")[0] for h in own if h != "id" and not h.startswith("s_"))

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes the table as a CSV that `robocal identify` reads, and the lengths of cables beside it as NAME-lengths.csv.

        Raises FileError where one exists."""
        from robocal.files.writing import write_text

        place = Path(path)
        parts = {place: self.text} | (
            {place.with_name(f"{place.stem}-lengths.csv"): self.lengths} if self.lengths else {}
        )
        for file in parts:
            if file.exists():
                raise FileError("there is a file already", file=file, expected="a new name")
        for file, text in parts.items():
            write_text(file, text)
        return place

    def __repr__(self) -> str:
        told = [t.splitlines() for t in (self.lengths, self.text) if t]
        return "Measurements: " + "; ".join(f"{len(lines) - 1} rows of {lines[0]}" for lines in told)


@named_arguments
def measurements(
    joints: ArrayLike | None = None,
    *,
    lengths: ArrayLike | None = None,
    position: ArrayLike | None = None,
    pose: ArrayLike | None = None,
    rotation: Any = None,
    quaternion: ArrayLike | None = None,
    quaternion_order: str | None = None,
    rotation_vector: ArrayLike | None = None,
    units: Sequence[str] | None = None,
    sigma: ArrayLike | None = None,
    turn_sigma: ArrayLike | None = None,
    length_sigma: ArrayLike | None = None,
    cables: Sequence[str] | None = None,
    columns: Mapping[str, ArrayLike] | None = None,
) -> Measurements:
    """Measured positions or full poses at joint values or cable lengths, from arrays or anything that numpy reads as one.

    joints (m, n) of an arm, or lengths (m, n) of a cable robot, as its sensors show them. Then position (m, 3), or pose (m, 4, 4). A
    position becomes a full pose with one of: rotation (m, 3, 3) or scipy's Rotation; quaternion (m, 4) with quaternion_order "xyzw" or
    "wxyz"; rotation_vector (m, 3).

    units: of joints or lengths, of positions, and of rotation_vector and turn_sigma (rad unless given). They are ("rad", "m") for arms and
    ("m", "m") for cable robots unless given.
    sigma: standard deviation of each coordinate, in the unit of positions: a number, (3,) or (m, 3). turn_sigma: the same of rotations.
    length_sigma: the same of lengths: a number, (n,) or (m, n).
    cables: the names of the columns of lengths, c1, c2, ... unless given.
    columns: further ones (m,) by header: "temperature [degC]", "group".

    Returns Measurements, which `rc.identify` and every other verb take in place of a data file.
    Raises FormatError for shapes, units or numbers that make no sense: it names the argument, what was found and what was expected.
    """
    if (joints is None) == (lengths is None):
        expected = "joints= (m, n) of an arm, or lengths= (m, n) of a cable robot"
        raise FormatError(
            "one of joints and lengths is needed",
            argument="joints",
            found=None if joints is None else "both",
            expected=expected,
        )
    what = "joints" if lengths is None else "lengths"
    first, second, turn = _units(units, what)
    at: Any = joints if lengths is None else lengths
    given = shapes.table(at, what)
    m, n = given.shape
    _refuse_turned(what, m, n, (position, pose, rotation, quaternion, rotation_vector))
    names = _names(cables, n, what)
    moved = {f"{name} [{first}]": given[:, i] for i, name in enumerate(names)}
    if length_sigma is not None:
        _only("length_sigma", what, "lengths")
        moved |= {
            f"s_{c} [{first}]": s
            for c, s in zip(names, shapes.spread(length_sigma, "length_sigma", m, n).T, strict=True)
        }
    seen: dict[str, NDArray[Any]] = {}
    place, turned = _poses(m, position, pose, rotation, quaternion, quaternion_order, rotation_vector, turn)
    titles = ("qx", "qy", "qz", "qw") if quaternion is not None else tuple(f"r{axis} [{turn}]" for axis in "xyz")
    if place is not None:
        seen |= _three("", place, second)
    if sigma is not None:
        _need("sigma", place, "position= or pose=")
        seen |= _three("s", shapes.spread(sigma, "sigma", m, 3), second)
    if turned is not None:
        seen |= dict(zip(titles, turned.T, strict=True))
    if turn_sigma is not None:
        _need("turn_sigma", turned, ", ".join(f"{t}=" for t in TURNS))
        seen |= _three("sr", shapes.spread(turn_sigma, "turn_sigma", m, 3), turn)
    if turned is not None and (sigma is None) != (turn_sigma is None):
        lacking = "sigma" if sigma is None else "turn_sigma"
        raise FormatError(
            "only one of two standard deviations is stated",
            argument=lacking,
            expected="both, or neither (then estimated)",
        )
    if place is None and what == "joints":
        expected = f"position= ({m}, 3), or pose= ({m}, 4, 4)"
        raise FormatError("nothing was measured at these joints", argument="position", expected=expected)
    further = dict(_further(columns or {}, m, {**moved, **seen}))
    if what == "joints":
        return Measurements(_text(moved | seen | further), of=what)
    # Rows of two tables belong together by their ids.
    ids = {} if "id" in further else {"id": np.array([f"row{i + 1}" for i in range(m)])}
    own = {"id": further["id"]} if "id" in further else ids
    if place is None:
        return Measurements(_text({**ids, **moved, **further}), of=what)
    return Measurements(_text({**ids, **seen, **further}), _text({**own, **moved}), what)


def _refuse_turned(what: str, m: int, n: int, others: Sequence[Any]) -> None:
    """Raises FormatError for joints or lengths (n, m) beside m poses."""
    rows = {len(o) for o in others if hasattr(o, "__len__")}
    if n in rows and m not in rows:
        raise FormatError(
            "wrong shape", argument=what, found=(m, n), expected=f"({n}, {m}): one row for each measurement, {what}.T"
        )


def _units(given: Sequence[str] | None, what: str) -> tuple[str, str, str]:
    """Units of joints or lengths, of positions and of rotations."""
    usual = ("rad", "m") if what == "joints" else ("m", "m")
    example = '("deg", "mm")' if what == "joints" else '("mm", "mm")'
    if given is None:
        return (*usual, "rad")
    if isinstance(given, str) or not isinstance(given, Sequence) or len(given) not in (2, 3):
        expected = f"{example}: of {what}, of positions, and perhaps of rotations"
        raise FormatError("units are said one by one", argument="units", found=given, expected=expected)
    first = shapes.unit(given[0], "units[0]", what, *(("rad", "m") if what == "joints" else ("m",)))
    turn = shapes.unit(given[2], "units[2]", "rotations", "rad") if len(given) > 2 else "rad"
    return first, shapes.unit(given[1], "units[1]", "positions", "m"), turn


def _names(cables: Sequence[str] | None, n: int, what: str) -> tuple[str, ...]:
    """The names of the columns of joints or lengths."""
    if cables is None:
        return tuple(f"{'q' if what == 'joints' else 'c'}{i + 1}" for i in range(n))
    _only("cables", what, "lengths")
    names = (cables,) if isinstance(cables, str) else tuple(map(str, cables))
    if len(names) != n or len(set(names)) < n:
        raise FormatError(
            "wrong names of cables", argument="cables", found=", ".join(names), expected=f"{n} names, each once"
        )
    return names


def _only(argument: str, what: str, needed: str) -> None:
    if what != needed:
        raise FormatError(f"this goes with {needed}=", argument=argument, found=f"{what}=", expected=f"{needed}=")


def _need(argument: str, there: object, expected: str) -> None:
    if there is None:
        raise FormatError("what was not given has no sigma", argument=argument, expected=expected)


def _poses(
    m: int, position: Any, pose: Any, rotation: Any, quaternion: Any, order: str | None, vector: Any, turn: str
) -> tuple[Array | None, Array | None]:
    """Positions (m, 3), and quaternions (m, 4), scalar last, or rotation vectors (m, 3) in the unit `turn`, of what was given of both."""
    given = {"pose": pose, "rotation": rotation, "quaternion": quaternion, "rotation_vector": vector}
    there = [name for name, value in given.items() if value is not None]
    if len(there) > 1:
        raise FormatError(
            "the rotation is given twice",
            argument=there[1],
            found=", ".join(there),
            expected=f"one of {', '.join(TURNS)}",
        )
    if order is not None and quaternion is None:
        raise FormatError(
            "this goes with quaternion=", argument="quaternion_order", found=order, expected="quaternion= (m, 4)"
        )
    if pose is not None:
        if position is not None:
            raise FormatError(
                "the position is given twice", argument="position", expected="pose= alone, or position= with rotation="
            )
        shift, axes = shapes.transforms(pose, "pose", m)
        return shift, _in_unit(so3.log(axes), turn)
    place: Array | None = None if position is None else shapes.table(position, "position", 3, m)
    if there and place is None:
        raise FormatError(
            "a rotation without a position", argument="position", expected=f"({m}, 3), or pose= ({m}, 4, 4)"
        )
    if vector is not None:
        turned = shapes.table(vector, "rotation_vector", 3, m)
        size = float(_in_si(np.linalg.norm(turned, axis=1), turn).max())
        if size > 2 * np.pi + 1e-6:  # tolerance: rounding of a whole turn
            found, expected = f"a turn of {size:.4g} rad", 'at most a whole turn; in degrees: units=(..., ..., "deg")'
            raise FormatError("no rotation turns so far", argument="rotation_vector", found=found, expected=expected)
        return place, turned
    if quaternion is not None:
        return place, shapes.quaternions(quaternion, order, m)
    return place, None if rotation is None else _in_unit(so3.log(shapes.rotations(rotation, "rotation", m)), turn)


def _in_unit(values: Array, name: str) -> Array:
    return UNITS[name].from_si(values)


def _in_si(values: Array, name: str) -> Array:
    return UNITS[name].to_si(values)


def _further(columns: Any, m: int, taken: Mapping[str, object]) -> Iterator[tuple[str, NDArray[Any]]]:
    if not isinstance(columns, Mapping):
        expected = 'a mapping by header, {"temperature [degC]": t}'
        raise FormatError("not a mapping", argument="columns", found=type(columns).__name__, expected=expected)
    for name, values in columns.items():
        argument = f"columns[{name!r}]"
        given = shapes.unmasked(values, argument)
        if given.shape != (m,):
            raise FormatError("wrong shape", argument=argument, found=given.shape, expected=f"({m},)")
        if str(name).partition(" [")[0] in {t.partition(" [")[0] for t in taken}:
            raise FormatError("this column stands there already", argument=argument, expected="another header")
        yield str(name), given


@named_arguments
def table(columns: Mapping[str, ArrayLike] | Any) -> Measurements:
    """A table as a file would hold it: columns (m,) by headers that carry units ("q1 [deg]", "x [mm]"), from a mapping or a
    data frame (anything with `__dataframe__`: pandas, polars, pyarrow). Raises FormatError for columns of different lengths."""
    if not isinstance(columns, Mapping):
        if not hasattr(columns, "__dataframe__"):
            expected = "a data frame, or a mapping of columns by header"
            raise FormatError("this is no table", argument="columns", found=type(columns).__name__, expected=expected)
        names = list(columns.__dataframe__().column_names())
        if (twice := next((n for n in names if names.count(n) > 1), None)) is not None:
            raise FormatError(
                "two columns have this header", argument="columns", found=str(twice), expected="each header once"
            )
        columns = {str(name): columns[name] for name in names}
    found = {str(k): shapes.unmasked(v, f"columns[{str(k)!r}]") for k, v in columns.items()}
    lengths = {v.shape for v in found.values()}
    if len(lengths) != 1 or len(next(iter(lengths))) != 1:
        said = ", ".join(f"{k}: {v.shape}" for k, v in found.items())
        raise FormatError("columns of different lengths", argument="columns", found=said, expected="(m,) each")
    return Measurements(_text(found))


# Keys of a data file and columns of a table, and the arguments that they were.
KEYS = {
    "joints.unit": "units[0]", "lengths.unit": "units[0]", "position.unit": "units[1]", "orientation.unit": "units[2]",
    "lengths.columns": "lengths", "lengths": "lengths", "joints.columns": "joints", "joints": "joints", "position.columns": "position",
    "orientation": "rotation",
}  # fmt: skip


def locate_array(error: InputError, data: object) -> InputError:
    """The same error of measurements that a program holds, at the argument that was wrong."""
    if error.file not in (NAME, LENGTHS) or error.argument is not None:
        return error
    error.argument = KEYS.get(error.key or "", "data")
    if error.key == "orientation" and isinstance(data, Measurements) and "qw" in data.columns:
        error.argument = "quaternion"
        if "form:" in str(error.expected):  # the line that reads them in another form
            error.argument, error.expected = "quaternion_order", "the other order"
    if error.argument != "data":
        error.file = error.key = None
    return error


def _three(stem: str, values: Array, unit: str) -> dict[str, NDArray[Any]]:
    return {f"{stem}{axis} [{unit}]": values[:, i] for i, axis in enumerate("xyz")}


def _text(table: Mapping[str, NDArray[Any]]) -> str:
    """The table as CSV, every number with all of its digits."""
    from robocal.files.csvtext import csv_text

    rows = zip(*(c.tolist() for c in table.values()), strict=True)
    return csv_text(
        tuple(table), [[repr(float(v)) if isinstance(v, float | np.floating) else v for v in r] for r in rows]
    )
