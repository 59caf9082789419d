"""Columns that nobody read: said once of each file, with the names that may have been meant.

A reader asks its table for columns; when it has finished, those that nobody asked for are left over. So a header that is
misspelt is named whatever the table is for, and no reader keeps a list of what it does not know.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from robocal.files.csvtable import CsvTable
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["Unread", "left_over", "near_miss", "remark_unknown_names", "unread_remarks"]

SHOWN = 6  # columns that a sentence names; more are counted
LOOKED = 200  # columns for which a known name is looked for
LONG = 40  # letters; no name that is known is longer
ALIKE = 0.68  # of the letters of two words


@dataclass(frozen=True)
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
    return tuple(
        remark_unknown_names(Code.COLUMNS_UNREAD, one.file, _guesses(one)) for one in files.values() if one.columns
    )


def remark_unknown_names(code: str, file: object, found: Mapping[str, str | None]) -> Remark:
    """A remark on words of a file that are not read, each with the known one that it looks like; these are named first."""
    found = {word if len(word) <= LONG else f"{word[: LONG - 3]}...": near for word, near in found.items()}
    missed = {word: near for word, near in found.items() if near is not None}
    order = [*missed, *(word for word in found if word not in missed)]
    more = len(order) - SHOWN
    return Remark.of(
        code,
        file=str(file),
        names=tuple(order[:SHOWN]),
        more=more if more > 0 else None,
        near=tuple(list(missed.values())[:SHOWN]) or None,
        misspelt=tuple(list(missed)[:SHOWN]) or None,
    )


def _guesses(one: Unread) -> dict[str, str | None]:
    return {c: near_miss(c, one.known) if i < LOOKED else None for i, c in enumerate(one.columns)}
