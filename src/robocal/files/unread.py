"""What of a table is not read: columns that nobody asked for, and rows that are left out.

A reader asks its table for columns; when it has finished, those that nobody asked for are left over. So a header that is
misspelt is named whatever the table is for, and no reader keeps a list of what it does not know. That is said once of each
file, with the names that may have been meant.

A row is left out where somebody named it, or where something is missing. A word names rows by the id of their configuration (where the
file has such a column), by the line that an editor shows, by a range of either (10-20), or as FILE:ROW and FILE:FROM-TO. What the file's
own ids say comes first.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from robocal._record import record
from robocal._types import Bools, Ints
from robocal.errors import FormatError, nearest
from robocal.files.csvtable import CsvTable
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = [
    "Excluded",
    "LeftOut",
    "Unread",
    "left_over",
    "near_miss",
    "remark_unknown_names",
    "split_list",
    "unread_remarks",
]

SHOWN = 6  # columns that a sentence names; more are counted
LOOKED = 200  # columns for which a known name is looked for
LONG = 40  # letters; no name that is known is longer
ALIKE = 0.68  # of the letters of two words


@record
class Unread:
    """The columns of a file that one reader left over, and the names that it would have read."""

    file: Path
    columns: tuple[str, ...]
    known: tuple[str, ...] = ()


def left_over(table: CsvTable, known: Iterable[str], silent: Iterable[str] = ()) -> Unread:
    """What nobody asked a table for. `known` are names that this reader would have read, `silent` those that other readers
    know, which belong there and need no word."""
    aside, there = set(silent), set(table.names)
    columns = tuple(c for c in table.unread() if c not in aside)
    return Unread(table.path, columns, tuple(k for k in dict.fromkeys(known) if k not in there))


def near_miss(word: str, known: Iterable[str]) -> str | None:
    """The known name of which a word looks like a slip of the pen: more than two thirds of the letters of both are alike."""
    from difflib import get_close_matches

    options = {name.lower(): name for name in known if len(name) <= LONG}
    found = get_close_matches(word.lower(), options, n=1, cutoff=ALIKE) if len(word) <= LONG else []
    return options[found[0]] if found else None


def unread_remarks(found: Iterable[Unread]) -> tuple[Remark, ...]:
    """One remark for each file: of a table that several data files read, on what none of them did."""
    files: dict[Path, Unread] = {}
    for one in found:
        before = files.get(one.file)
        if before is not None:
            both = tuple(c for c in before.columns if c in one.columns)
            one = Unread(one.file, both, tuple(dict.fromkeys((*before.known, *one.known))))
        files[one.file] = one
    some = (one for one in files.values() if one.columns)
    return tuple(remark_unknown_names(Code.COLUMNS_UNREAD, one.file, _guesses(one)) for one in some)


def remark_unknown_names(code: str, file: object, found: Mapping[str, str | None]) -> Remark:
    """A remark on words of a file that are not read, each with the known one that it looks like; these are named first."""
    found = {word if len(word) <= LONG else f"{word[: LONG - 3]}...": near for word, near in found.items()}
    missed = {word: near for word, near in found.items() if near is not None}
    order = [*missed, *(word for word in found if word not in missed)]
    names, more = tuple(order[:SHOWN]), max(len(order) - SHOWN, 0) or None
    near, misspelt = (tuple(words)[:SHOWN] or None for words in (missed.values(), missed))
    return Remark.of(code, file=str(file), names=names, more=more, near=near, misspelt=misspelt)


def _guesses(one: Unread) -> dict[str, str | None]:
    return {c: near_miss(c, one.known) if i < LOOKED else None for i, c in enumerate(one.columns)}


# --- rows -------------------------------------------------------------------------------------------------------------------

_RANGE = re.compile(r"(\d+)\s*-\s*(\d+)")
ROWS_SHOWN = 5


@record
class LeftOut:
    """Rows of a file that were not read, as an editor numbers lines, and why: `excluded` or `missing`."""

    file: Path
    rows: tuple[int, ...]
    why: str

    @property
    def remark(self) -> Remark:
        """What is said of it."""
        code = Code.ROWS_EXCLUDED if self.why == "excluded" else Code.ROWS_MISSING
        few = tuple(map(str, self.rows[:ROWS_SHOWN])) + (("...",) if len(self.rows) > ROWS_SHOWN else ())
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
