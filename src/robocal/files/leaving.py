"""Rows that are left out of a table: those that somebody named, and those where something is missing.

A word names rows by the id of their configuration (where the file has such a column), by the line that an editor shows, by
a range of either (10-20), or as FILE:ROW and FILE:FROM-TO. What the file's own ids say comes first.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from robocal._types import Bools, Ints
from robocal.errors import FormatError, nearest
from robocal.files.csvtable import CsvTable
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["Excluded", "LeftOut", "split_list"]

_RANGE = re.compile(r"(\d+)\s*-\s*(\d+)")
SHOWN = 5


@dataclass(frozen=True)
class LeftOut:
    """Rows of a file that were not read, as an editor numbers lines, and why: `excluded` or `missing`."""

    file: Path
    rows: tuple[int, ...]
    why: str

    @property
    def remark(self) -> Remark:
        """What is said of it."""
        code = Code.ROWS_EXCLUDED if self.why == "excluded" else Code.ROWS_MISSING
        few = tuple(map(str, self.rows[:SHOWN])) + (("...",) if len(self.rows) > SHOWN else ())
        return Remark.of(code, file=str(self.file), count=len(self.rows), rows=few)


def split_list(given: Iterable[object]) -> tuple[str, ...]:
    """Words given one by one or separated by commas."""
    return tuple(w for word in given for part in str(word).split(",") if (w := part.strip()))


@dataclass
class Excluded:
    """Words that name rows, and which of them have named any so far; `key` is where they were said."""

    names: tuple[str, ...]
    key: str
    file: Path | None = None
    used: set[str] = field(default_factory=set)
    known: list[str] = field(default_factory=list)

    def rows(self, table: CsvTable, ids: Sequence[str] | None) -> Bools:
        """Which rows of a table are named, (k,); `ids` are those of the configurations where the file has them."""
        out = np.zeros(len(table), dtype=bool)
        if not self.names:
            return out
        names = np.array(ids if ids is not None else [""] * len(table), dtype=object)
        numbers = np.array([int(n) if str(n).isdecimal() else -1 for n in names])
        self.known += [*dict.fromkeys(map(str, names[names != ""])), *(f"{table.path.name}:{n}" for n in table.lines)]
        for word in self.names:
            hit = _match_rows(word, table, names, numbers)
            self.used |= {word} if hit.any() else set()
            out |= hit
        return out

    def finish(self) -> None:
        """Raises FormatError for a word that named no row of any file."""
        expected = "the id of a configuration, a row as an editor numbers it, a range such as 10-20, or FILE:ROW"
        for word in self.names:
            if word not in self.used:
                message, near = "this names no row", nearest(word, self.known)
                raise FormatError(message, file=self.file, key=self.key, found=word, expected=expected, suggestion=near)


def _match_rows(word: str, table: CsvTable, names: NDArray[np.object_], numbers: Ints) -> Bools:
    """The rows that one word names, (k,)."""
    same = np.asarray(names == word, dtype=bool)
    if same.any():
        return same
    file, colon, rest = word.rpartition(":")
    if colon:
        known = {str(table.path), table.path.name, table.path.stem}
        return _lines(rest, table.lines) if file in known else np.zeros(len(table), dtype=bool)
    ranged = _RANGE.fullmatch(word)
    if ranged and (numbers >= 0).any():
        return np.asarray((numbers >= int(ranged[1])) & (numbers <= int(ranged[2])))
    return _lines(word, table.lines)


def _lines(word: str, lines: Ints) -> Bools:
    ranged = _RANGE.fullmatch(word)
    first, last = (int(ranged[1]), int(ranged[2])) if ranged else (int(word) if word.isdecimal() else -1,) * 2
    return np.asarray((lines >= first) & (lines <= last))
