"""Where the numbers of poses stand: a CSV, or a folder with a YAML file for each pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.errors import FileError, FormatError
from robocal.files.csvtable import CsvTable
from robocal.files.headers import IDS, matrices
from robocal.files.text import InputFile
from robocal.files.units import parse_unit
from robocal.files.yamlio import YamlDocument, load

__all__ = ["FolderSource", "TableSource", "read_times"]

NAMES = ("image", "view", "file", "name", *IDS)  # columns that name what belongs to a pose
TIMES = ("time", "timestamp", "stamp", "t")
NESTED = 4  # grid: levels of keys in a YAML file of one pose


@record(eq=False)
class TableSource:
    """A CSV."""

    table: CsvTable

    @property
    def path(self) -> Path:
        return self.table.path

    @property
    def columns(self) -> Sequence[str]:
        return self.table.names

    @property
    def files(self) -> tuple[InputFile, ...]:
        return (InputFile(self.table.path, self.table.sha256),)

    @property
    def names(self) -> tuple[str, ...] | None:
        column = next(filter(self.table.has, NAMES), None)
        return None if column is None else self.table.texts(column)

    def has(self, name: str) -> bool:
        return self.table.has(name)

    @property
    def matrices(self) -> list[str]:
        """The prefixes of columns of a matrix."""
        return matrices(self.table)

    def unit(self, name: str) -> str | None:
        return self.table.unit(name)

    def numbers(self, names: Sequence[str]) -> Array:
        return self.table.numbers(names)

    def fail(self, message: str, row: int | None = None, **facts: Any) -> FormatError:
        return self.table.fail(message, row, **facts)


@record(eq=False)
class FolderSource:
    """A folder with a YAML file for each pose: keys x, y, z, qx, ... at any depth; its name is that of the pose."""

    path: Path
    documents: tuple[YamlDocument, ...]
    cells: tuple[Mapping[str, Any], ...]

    @classmethod
    def read(cls, place: Path) -> FolderSource:
        paths = sorted(p for p in place.iterdir() if p.suffix.lower() in (".yaml", ".yml") and p.is_file())
        if not paths:
            raise FileError(
                "there are no poses in this folder", file=place, expected="a YAML file for each pose, or a CSV"
            )
        documents = tuple(map(load, paths))
        return cls(place, documents, tuple(_flat(d.data) for d in documents))

    @property
    def columns(self) -> Sequence[str]:
        return tuple(self.cells[0])

    @property
    def files(self) -> tuple[InputFile, ...]:
        return tuple(InputFile(d.path, d.sha256) for d in self.documents)

    @property
    def names(self) -> tuple[str, ...] | None:
        return tuple(d.path.stem for d in self.documents)

    def has(self, name: str) -> bool:
        return name in self.cells[0]

    @property
    def matrices(self) -> list[str]:
        """None: a file of one pose has names for its numbers."""
        return []

    def unit(self, name: str) -> str | None:
        return None

    def numbers(self, names: Sequence[str]) -> Array:
        out = np.empty((len(self.cells), len(names)))
        for row, cell in enumerate(self.cells):
            for i, name in enumerate(names):
                value = cell.get(name)
                if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
                    raise self.fail("not a number", row, key=name, found=value, expected="a finite number")
                out[row, i] = value
        return out

    def fail(self, message: str, row: int | None = None, **facts: Any) -> FormatError:
        return FormatError(message, file=self.path if row is None else self.documents[row].path, **facts)


def read_times(source: TableSource | FolderSource) -> tuple[Array | None, str]:
    """Times in s, or None; and the unit that the head of their column states. Raises FormatError."""
    time = next(filter(source.has, TIMES), None)
    if time is None:
        return None, ""
    stated = source.unit(time) or ""
    unit = parse_unit(stated or "s", "s", file=source.path, column=time)
    return np.asarray(unit.to_si(source.numbers([time])[:, 0])), unit.name if stated else ""


def _flat(data: Mapping[str, Any], prefix: str = "", depth: int = 0) -> dict[str, Any]:
    """Keys of a pose without what stands above them; a quaternion below `orientation` has its letter before it."""
    out: dict[str, Any] = {}
    for name, value in data.items():
        word = str(name).casefold()
        if isinstance(value, Mapping):
            turned = word in ("orientation", "rotation", "quaternion", "q")
            out |= (
                _flat(value, "q" if turned and set(map(str, value)) >= set("xyzw") else "", depth + 1)
                if depth < NESTED
                else {}
            )
        else:
            out[prefix + word] = value
    return out
