"""A CSV as a table of text cells whose every error names file, row and column.

Rows are numbered as an editor numbers lines, from 1. Blank lines, comments (`#`, `//`, `%`) and titles before the header are skipped;
quoted fields, CRLF, trailing separators and a byte-order mark are accepted. Headers may carry units: `q1 [deg]`, `x (mm)`, or a line
of units below. How numbers are written: `files.dialect`.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import field, record, replace
from robocal._types import Array, Bools, Ints
from robocal.errors import FormatError, one_of
from robocal.files.dialect import (
    COMMA,
    PLAIN,
    Numbers,
    commented_header,
    content_lines,
    find_header,
    find_numbers,
    find_separator,
    is_bare,
    may_be_foreign,
    plain_minus,
    split_columns,
    split_rows,
    split_unit,
    two_meanings,
    units_row,
)
from robocal.files.text import FORBIDDEN, MEGABYTE, forbidden_character, meant, read_text
from robocal.files.units import last_digits
from robocal.quantities import LARGEST
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["CsvTable", "MissingCells", "read_csv"]

SIZE_LIMIT, ROW_LIMIT, CELL_LIMIT = 20 * MEGABYTE, 500_000, 3_000_000  # what is read within seconds and 1 GB
HEAD = 100  # lines among which the header is looked for
MISSING = ("", "nan", "na")  # how tables write a cell that nobody filled
SKIP = "csv: {missing: skip} in the data file, which leaves such rows out"


class MissingCells(Exception):
    """Some rows (indices) lack a cell that is needed, in a table whose reader wants to know of all of them."""

    def __init__(self, rows: Ints) -> None:
        self.rows = rows
        super().__init__(f"{len(rows)} rows")


@record
class CsvTable:
    """Cells by column; `lines` are the line numbers of the rows; `names` are empty without a header; `units` those in the header, or None,
    `head` is its line. `skip` says that rows in which something is missing are left out, `gone` are the ids of rows that were. `asked`
    notes which columns somebody asked for, so that who has read can say which nobody did. `alone`: a list without a data file.
    `separator` and `style` are how it is written, `remarks` what its reader says of that."""

    path: Path
    sha256: str
    names: tuple[str, ...]
    units: tuple[str | None, ...]
    lines: Ints
    cells: tuple[tuple[str, ...], ...] = field(repr=False)
    style: Numbers = PLAIN
    separator: str = ","
    open: bool = False  # whether nobody said how numbers are written
    skip: bool = False
    alone: bool = False
    gone: frozenset[str] = frozenset()
    head: int | None = None
    remarks: tuple[Remark, ...] = field(default=(), compare=False)
    asked: set[int] = field(default_factory=set, compare=False, repr=False)  # one set for all tables made of this one

    def __len__(self) -> int:
        return len(self.lines)

    def without(self, rows: Bools, ids: Sequence[str] | None = None) -> CsvTable:
        """The table without some rows (k,); `ids` (k,) name them for those who look for them. Raises FormatError when none
        is left."""
        if rows.all():
            raise FormatError("every row is left out", file=self.path, expected="at least one row")
        kept = np.flatnonzero(~rows)
        gone = self.gone | {name for name, out in zip(ids or (), rows, strict=False) if out}
        cells = tuple(tuple(column[i] for i in kept) for column in self.cells)
        return replace(self, lines=self.lines[kept], cells=cells, gone=gone)

    @property
    def _or_skip(self) -> str:
        return "" if self.alone else f", or {SKIP}"

    @property
    def width(self) -> int:
        """The number of columns."""
        return len(self.units)

    def fail(self, message: str, row: int | None = None, column: str | int | None = None, **facts: Any) -> FormatError:
        """An error of this file; `row` is the index of a data row."""
        line = None if row is None else int(self.lines[row])
        return FormatError(message, file=self.path, row=line, column=column, **facts)

    def insist(self, good: Bools, columns: Sequence[str | int], message: str, found: Array, **facts: Any) -> None:
        """Raises FormatError at the first cell of columns (k, d) that is not good; of what makes a whole row (k,), at the first column."""
        bad = np.argwhere(~good)
        if len(bad):
            at = tuple(map(int, bad[0]))
            column = self.label(self.find(columns[at[1] if len(at) > 1 else 0]))
            raise self.fail(message, at[0], column, found=float(found[at]), **facts)

    def find(self, column: str | int) -> int:
        """The index of a column by name (with or without its unit) or zero-based number. Raises FormatError naming the
        nearest."""
        if isinstance(column, int):
            if not 0 <= column < self.width:
                expected = f"0 to {self.width - 1}, counted from zero"
                raise self.fail("there is no such column", column=column, expected=expected)
            self.asked.add(column)
            return column
        plain = split_unit(column)[0]
        hits = [i for i, name in enumerate(self.names) if name in (column, plain)]
        hits = hits or [i for i, name in enumerate(self.names) if name.casefold() == plain.casefold()]
        if len(hits) > 1:
            message, expected = "several columns have this name", "a separate name for every column that is read"
            found = f"columns {', '.join(map(str, hits))}, counted from zero"
            raise FormatError(message, file=self.path, row=self.head, column=column, found=found, expected=expected)
        if not hits and not self.names:
            raise self.fail("the file has no header", column=column, expected="column numbers, counted from zero")
        if not hits:
            raise self.fail("there is no such column", column=column, **one_of(plain, self.names))
        self.asked.add(hits[0])
        return hits[0]

    def has(self, name: str) -> bool:
        """Whether a column has this name; capitals do not count where no other column has it."""
        return name in self.names or [n.casefold() for n in self.names].count(name.casefold()) == 1

    def unread(self) -> tuple[str, ...]:
        """The headers that nobody asked for, as they are to be called; none of a file without a header."""
        left = (i for i in range(self.width) if self.names and i not in self.asked)
        return tuple(dict.fromkeys(self.names[i] or f"number {i} (no name)" for i in left))

    def label(self, index: int) -> str | int:
        """What to call a column in a message."""
        return self.names[index] if self.names else index

    def unit(self, column: str | int) -> str | None:
        """The unit that the header states."""
        return self.units[self.find(column)]

    def strip(self, at: int) -> list[str]:
        """The cells of the column with this index, without blanks around them."""
        return list(map(str.strip, self.cells[at]))

    def texts(self, column: str | int) -> tuple[str, ...]:
        """The cells of a column, stripped. Raises FormatError for an empty one."""
        at = self.find(column)
        said = self.strip(at)
        out = tuple(map(meant, said))
        if forbidden_character("".join(out)):
            row, name = next((row, name) for row, name in enumerate(out) if forbidden_character(name))
            raise self.fail(FORBIDDEN, row, self.label(at), found=name, expected="one line of text")
        if len(set(out)) < len(set(said)):
            raise self.fail("names that differ in an apostrophe before = + - @ only", column=self.label(at))
        if "" in out:
            if self.skip:
                raise MissingCells(np.array([i for i, cell in enumerate(out) if not cell]))
            raise self.fail("the cell is empty", out.index(""), self.label(at), expected=f"a name{self._or_skip}")
        # Names of their own: those among the cells of a table would keep the memory of all of them.
        return tuple("\n".join(out).split("\n")) if out else out

    def numbers(self, columns: Sequence[str | int]) -> Array:
        """Finite numbers, shape (rows, columns). Raises FormatError for the first cell that is none."""
        out = np.empty((len(self), len(columns)))
        for i, column in enumerate(columns):
            at = self.find(column)
            cells = self.cells[at]
            if self.skip and len(lacking := self.lacking([column])):
                raise MissingCells(lacking)
            if self.open and any("." in cell for cell in cells) and two_meanings(self._dotted):
                raise self._two_meanings(at)
            try:
                if not self.style.plain:
                    cells = self.style.translate_all(cells)
                if "_" in "".join(cells):
                    raise ValueError
                out[:, i] = np.fromiter(map(float, cells), float, len(cells))
            except ValueError:
                raise self._bad_cell(at) from None
            if not (np.abs(out[:, i]) < LARGEST).all():
                raise self._bad_cell(at)
        return out

    @cached_property
    def _dotted(self) -> tuple[tuple[str, ...], ...]:
        """The columns of numbers that have a dot."""
        dotted = (c for c in self.cells if any("." in v for v in c))
        return tuple(c for c in dotted if not any(v.strip("+-. 0123456789") for v in c))

    def _two_meanings(self, at: int) -> FormatError:
        row = ["." in cell for cell in self.cells[at]].index(True)
        message, found = "a dot that may stand between thousands", self.cells[at][row].strip()
        expected = 'csv: {thousands: "."} or csv: {decimal: "."} in a data file'
        return self.fail(message, row, self.label(at), found=found, expected=expected)

    def lacking(self, columns: Sequence[str | int]) -> Ints:
        """The rows, by index, in which a cell of some columns is empty or says that it is."""
        out = np.zeros(len(self), dtype=bool)
        for column in columns:
            out |= np.fromiter(map(_missing, self.cells[self.find(column)]), bool, len(self))
        return np.flatnonzero(out)

    def digits(self, columns: Sequence[str | int]) -> Array:
        """What one unit in the last digit of each number means, (rows, columns): `units.last_digits`."""
        cells = [self.cells[self.find(c)] for c in columns]
        if not cells:
            return np.empty((len(self), 0))
        return last_digits(cells if self.style.plain else list(map(self.style.translate_all, cells)))

    def _bad_cell(self, at: int) -> FormatError:
        """The error for the first cell of a column that is not a finite number."""
        for row, cell in enumerate(self.strip(at)):
            column = self.label(at)
            if not cell:
                return self.fail("the cell is empty", row, column, expected=f"a number{self._or_skip}")
            wrong = self._wrong(cell)
            if wrong is not None:
                return self.fail(wrong[0], row, column, found=cell, expected=wrong[1])
        raise AssertionError(at)

    def _wrong(self, cell: str) -> tuple[str, str] | None:
        """What is wrong with a cell that is not a finite number, and what is expected there; None where nothing is."""
        decimal, plain = self.style.decimal, self.style.translate(cell)
        if decimal != "." and "?" in plain:
            return "a decimal point where the file announces a decimal comma", "1,5"
        try:
            value = math.nan if "_" in cell else float(plain)
        except ValueError:
            value = math.nan
        if _missing(cell):
            return "not a finite number", f"a finite number{self._or_skip}"
        if math.isinf(value) or plain.lower().strip("+-") in ("nan", "inf", "infinity"):
            return "not a finite number", "a finite number"
        if not math.isnan(value):
            return None if abs(value) < LARGEST else ("so large a number is no measurement", f"below {LARGEST:g}")
        if decimal == "." and COMMA.fullmatch(cell):
            hint = "a decimal point" if self.alone else "a decimal point; a data file can announce the comma, csv: "
            hint += "" if self.alone else f"{{separator: {self.separator!r}, decimal: ','}}, or thousands: ','"
            return "a decimal comma that the file does not announce", hint
        return "not a number", "a number"


def read_csv(
    path: str | os.PathLike[str],
    *,
    separator: str | None = None,
    decimal: str | None = None,
    thousands: str | None = None,
    header: bool = True,
) -> CsvTable:
    """Reads a CSV; what is not said of how it is written, the table says itself (`files.dialect`). Raises FileError or FormatError."""
    source = read_text(path, limit=SIZE_LIMIT, western=True)
    text = plain_minus(source.text.replace("\r\n", "\n").replace("\r", "\n"))
    _refuse_more("rows", text.count("\n"), ROW_LIMIT, source.path)
    kept, stated = content_lines(text)
    if not kept:
        raise FormatError("the file has no rows", file=source.path)
    remarks = [Remark.of(Code.CSV_WESTERN, file=str(source.path))] if source.western else []
    titles = find_header([line for _, line in kept[:HEAD]], separator or stated) if header else 0
    if titles:
        remarks.append(Remark.of(Code.CSV_TITLE, file=str(source.path), count=titles, head=kept[titles][0]))
        kept = kept[titles:]
    elif header and (named := commented_header(text, kept, separator or stated)):
        remarks.append(Remark.of(Code.CSV_COMMENTED, file=str(source.path), head=named[0]))
        kept = [named, *kept]
    chosen = separator or stated or find_separator(kept[0][1])
    _refuse_more("cells", len(kept) + text.count(chosen), CELL_LIMIT, source.path)
    foreign = may_be_foreign(text, chosen, decimal)
    bare = not foreign and is_bare(text, chosen)
    rows = split_rows(kept[:2] if bare else kept, chosen, source.path)
    names, top = tuple[str, ...](), 0  # lines of the header
    units: tuple[str | None, ...] = (None,) * (len(rows[0]) - (len(rows[0]) > 1 and not rows[0][-1].strip()))
    if header:
        first, top = [cell.strip() for cell in rows[0]], 1
        while first and not first[-1]:
            first.pop()
        if not any(re.search(r"[^\d\s.,;eE+-]", cell) for cell in first):
            message = "there is no header in the first row"
            expected = "the names of the columns, as x [mm]; or in a data file csv: {header: false}"
            raise FormatError(message, file=source.path, row=kept[0][0], expected=expected)
        parts = [split_unit(cell) for cell in first]
        names, units = tuple(p[0] for p in parts), tuple(p[1] for p in parts)
        below = units_row(rows[1][: len(units)]) if len(rows) > 1 and not any(units) else None
        if below is not None:
            units, top = (*below, *[None] * (len(units) - len(below))), 2
    head, kept, rows = kept[0][0] if header else None, kept[top:], rows[top:]
    if not kept:
        raise FormatError("the file has a header but no rows", file=source.path)
    lines = np.array([i for i, _ in kept], dtype=np.int64)
    # Names such as 1,2 say nothing of numbers: where headers have units, columns with one decide.
    some = [i for i, unit in enumerate(units) if unit] or range(len(units))
    asked = (row[i] for row in rows for i in some if i < len(row)) if foreign else ()
    style = find_numbers(asked, decimal, thousands)
    between = chosen == "," and "," in text and '"' not in text  # commas separate cells, and nothing else
    unsaid = style.plain and decimal is None and thousands is None and not between
    cells = split_columns(kept, chosen, len(units), source.path, style.decimal, None if bare else rows)
    return CsvTable(
        source.path, source.sha256, names, units, lines, cells, style, chosen, unsaid, head=head, remarks=tuple(remarks)
    )  # fmt: skip


def _refuse_more(what: str, found: int, most: int, path: Path) -> None:
    if found > most:
        raise FormatError(f"the table has too many {what}", file=path, found=found, expected=f"at most {most}")


def _missing(cell: str) -> bool:
    return cell.strip().lower().lstrip("+-") in MISSING
