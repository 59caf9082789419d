"""A CSV as a table of text cells whose every error names file, row and column.

Rows are numbered as an editor numbers lines, from 1. Blank lines and lines that begin with `#` are skipped; quoted
fields, CRLF, trailing separators and a byte-order mark are accepted. Headers may carry units in brackets: `q1 [deg]`.
"""

from __future__ import annotations

import csv
import io
import math
import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.errors import FormatError, one_of
from robocal.files.text import FORBIDDEN, MEGABYTE, forbidden_character, harmless, meant, read_text
from robocal.files.units import last_digits

__all__ = ["CsvTable", "MissingCells", "csv_columns", "csv_text", "read_csv"]

_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
SIZE_LIMIT, ROW_LIMIT, CELL_LIMIT = 20 * MEGABYTE, 500_000, 3_000_000  # what is read within seconds and 1 GB
MISSING = ("", "nan", "na")  # how tables write a cell that nobody filled
SKIP = "csv: {missing: skip} in the data file, which leaves such rows out"
ANNOUNCE = "a data file can announce them, csv: {separator: ..., decimal: ','}"
SEPARATORS = {";": "';'", "\t": "a tab", ",": "','", " ": "a space", "|": "'|'"}


class MissingCells(Exception):
    """Some rows (indices) lack a cell that is needed, in a table whose reader wants to know of all of them."""

    def __init__(self, rows: Ints) -> None:
        self.rows = rows
        super().__init__(f"{len(rows)} rows")


@dataclass(frozen=True)
class CsvTable:
    """Cells by row; `lines` are the line numbers of the rows; `names` are empty without a header; `units` those in the header, or None,
    `head` is its line. `skip` says that rows in which something is missing are left out, `gone` are the ids of rows that were. `asked`
    notes which columns somebody asked for, so that who has read can say which nobody did. `alone`: a list without a data file."""

    path: Path
    sha256: str
    names: tuple[str, ...]
    units: tuple[str | None, ...]
    lines: Ints
    cells: tuple[tuple[str, ...], ...]
    decimal: str = "."
    skip: bool = False
    alone: bool = False
    gone: frozenset[str] = frozenset()
    head: int | None = None
    asked: set[int] = field(default_factory=set, compare=False, repr=False)  # one set for all tables made of this one

    def __len__(self) -> int:
        return len(self.cells)

    @cached_property
    def _columns(self) -> tuple[tuple[str, ...], ...]:
        return tuple(zip(*self.cells, strict=True))

    def without(self, rows: Bools, ids: Sequence[str] | None = None) -> CsvTable:
        """The table without some rows (k,); `ids` (k,) name them for those who look for them. Raises FormatError when none
        is left."""
        if rows.all():
            raise FormatError("every row is left out", file=self.path, expected="at least one row")
        kept = np.flatnonzero(~rows)
        gone = self.gone | {name for name, out in zip(ids or (), rows, strict=False) if out}
        return replace(self, lines=self.lines[kept], cells=tuple(self.cells[i] for i in kept), gone=gone)

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
        plain = _split_unit(column)[0]
        hits = [i for i, name in enumerate(self.names) if name in (column, plain)]
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

    def texts(self, column: str | int) -> tuple[str, ...]:
        """The cells of a column, stripped. Raises FormatError for an empty one."""
        at = self.find(column)
        said = [row[at].strip() for row in self.cells]
        out = tuple(map(meant, said))
        for row, name in enumerate(out):
            if forbidden_character(name):
                raise self.fail(FORBIDDEN, row, self.label(at), found=name, expected="one line of text")
        if len(set(out)) < len(set(said)):
            raise self.fail("names that differ in an apostrophe before = + - @ only", column=self.label(at))
        if "" in out:
            if self.skip:
                raise MissingCells(np.array([i for i, cell in enumerate(out) if not cell]))
            raise self.fail("the cell is empty", out.index(""), self.label(at), expected=f"a name{self._or_skip}")
        return out

    def numbers(self, columns: Sequence[str | int]) -> Array:
        """Finite numbers, shape (rows, columns). Raises FormatError for the first cell that is none."""
        out = np.empty((len(self), len(columns)))
        for i, column in enumerate(columns):
            at = self.find(column)
            cells = self._columns[at]
            if self.skip and (lacking := [k for k, cell in enumerate(cells) if _missing(cell)]):
                raise MissingCells(np.array(lacking))
            every = "".join(cells)
            try:
                if ("." if self.decimal != "." else "_") in every:
                    raise ValueError
                if self.decimal in every and self.decimal != ".":
                    cells = tuple(cell.replace(self.decimal, ".") for cell in cells)
                out[:, i] = list(map(float, cells))
            except ValueError:
                raise self._bad_cell(at) from None
            if not np.isfinite(out[:, i]).all():
                raise self._bad_cell(at)
        return out

    def digits(self, columns: Sequence[str | int]) -> Array:
        """What one unit in the last digit of each number means, (rows, columns): `units.last_digits`."""
        cells = [self._columns[self.find(c)] for c in columns]
        if not cells:
            return np.empty((len(self), 0))
        return last_digits([c if self.decimal == "." else [v.replace(self.decimal, ".") for v in c] for c in cells])

    def _bad_cell(self, at: int) -> FormatError:
        """The error for the first cell of a column that is not a finite number."""
        for row, cells in enumerate(self.cells):
            cell, column = cells[at].strip(), self.label(at)
            if not cell:
                return self.fail("the cell is empty", row, column, expected=f"a number{self._or_skip}")
            wrong = self._wrong(cell)
            if wrong is not None:
                return self.fail(wrong[0], row, column, found=cell, expected=wrong[1])
        raise AssertionError(at)

    def _wrong(self, cell: str) -> tuple[str, str] | None:
        """What is wrong with a cell that is not a finite number, and what is expected there; None where nothing is."""
        if self.decimal != "." and "." in cell:
            return "a decimal point where the file announces a decimal comma", "1,5"
        plain = cell.replace(self.decimal, ".")
        try:
            value = math.nan if "_" in cell else float(plain)
        except ValueError:
            value = math.nan
        if _missing(cell):
            return "not a finite number", f"a finite number{self._or_skip}"
        if math.isinf(value) or plain.lower().strip("+-") in ("nan", "inf", "infinity"):
            return "not a finite number", "a finite number"
        if not math.isnan(value):
            return None
        if self.decimal == "." and _COMMA.fullmatch(cell):
            hint = 'a decimal point; a data file can announce the comma, csv: {separator: ";", decimal: ","}'
            return "a decimal comma that the file does not announce", hint
        return "not a number", "a number"


def read_csv(
    path: str | os.PathLike[str], *, separator: str | None = None, decimal: str = ".", header: bool = True
) -> CsvTable:
    """Reads a CSV; without `separator` the first line decides. Raises FileError or FormatError."""
    source = read_text(path, limit=SIZE_LIMIT)
    text = source.text.replace("\r\n", "\n").replace("\r", "\n")
    _refuse_more("rows", text.count("\n"), ROW_LIMIT, source.path)
    numbered = enumerate(text.split("\n"), start=1)
    kept = [(i, line) for i, line in numbered if line.strip(" \t;,|") and not line.lstrip().startswith("#")]
    if not kept:
        raise FormatError("the file has no rows", file=source.path)
    chosen = separator if separator is not None else _guess(kept[0][1])
    _refuse_more("cells", len(kept) + text.count(chosen), CELL_LIMIT, source.path)
    rows = _split(kept, chosen, source.path)
    names: tuple[str, ...] = ()
    units: tuple[str | None, ...] = ()
    lines = np.array([i for i, _ in kept], dtype=np.int64)
    if header:
        first = [cell.strip() for cell in rows[0]]
        while first and not first[-1]:
            first.pop()
        if not any(re.search(r"[^\d\s.,;eE+-]", cell) for cell in first):
            message, expected = "there is no header in the first row", "csv: {header: false}"
            raise FormatError(message, file=source.path, row=kept[0][0], expected=expected)
        parts = [_split_unit(cell) for cell in first]
        names, units = tuple(p[0] for p in parts), tuple(p[1] for p in parts)
        rows, lines = rows[1:], lines[1:]
    else:
        units = (None,) * (len(rows[0]) - (len(rows[0]) > 1 and not rows[0][-1].strip()))
    if not rows:
        raise FormatError("the file has a header but no rows", file=source.path)
    width, described = len(units), (source.path, chosen, decimal)
    cells = tuple(_fit(row, width, int(line), *described) for row, line in zip(rows, lines, strict=True))
    head = kept[0][0] if header else None
    return CsvTable(source.path, source.sha256, names, units, lines, cells, decimal, head=head)


def _refuse_more(what: str, found: int, most: int, path: Path) -> None:
    if found > most:
        raise FormatError(f"the table has too many {what}", file=path, found=found, expected=f"at most {most}")


def csv_text(header: Sequence[object], rows: Iterable[Sequence[object]]) -> str:
    """The text of a CSV: commas, one line per row, quoted where a cell needs it; text that a spreadsheet would run as a
    formula gets an apostrophe before it (`files.text`)."""
    return _written([harmless(cell) for cell in row] for row in (header, *rows))


def csv_columns(header: Sequence[str], columns: Sequence[Sequence[str]]) -> str:
    """The same of columns whose cells are `harmless` already."""
    return _written((header, *zip(*columns, strict=True)))


def _written(rows: Iterable[Sequence[object]]) -> str:
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(rows)
    return stream.getvalue()


def _missing(cell: str) -> bool:
    return cell.strip().lower().lstrip("+-") in MISSING


def _split_unit(header: str) -> tuple[str, str | None]:
    header = meant(header.strip())
    name, bracket, unit = header.rpartition("[")
    if bracket and unit.endswith("]") and "]" not in unit[:-1]:
        return name.strip(), unit[:-1].strip()
    return header, None


def _guess(line: str) -> str:
    """The separator of a line: a semicolon or a tab settles it, then the comma, then spaces."""
    bare = re.sub(r"\[[^\[\]]*\]|\"[^\"]*\"", "", line)
    return next((s for s in (";", "\t", ",", "|") if s in bare), " " if " " in bare.strip() else ",")


def _split(kept: list[tuple[int, str]], separator: str, path: Path) -> list[list[str]]:
    """The cells of every line; a quoted field must end on its line."""
    options: dict[str, Any] = {"delimiter": separator, "skipinitialspace": True, "strict": True}
    texts = [line.strip() if separator == " " else line for _, line in kept]
    try:
        rows = list(csv.reader(texts, **options))
        if len(rows) == len(texts):
            return rows
    except csv.Error:
        pass
    for (number, _), text in zip(kept, texts, strict=True):
        try:
            if len(list(csv.reader([text], **options))) != 1:
                raise csv.Error("several rows in one line")
        except csv.Error as error:
            raise FormatError(f"the row cannot be split into cells: {error}", file=path, row=number) from None
    raise FormatError("a quoted cell does not end on its line", file=path)


def _fit(row: list[str], width: int, line: int, path: Path, separator: str, decimal: str) -> tuple[str, ...]:
    """A row of exactly `width` cells; an empty last cell behind a trailing separator is dropped."""
    while len(row) > width and not row[-1].strip():
        row = row[:-1]
    if len(row) != width:
        expected = f"{width} columns, separated by {SEPARATORS.get(separator, repr(separator))}"
        if separator == "," and decimal == "." and len(row) > width:
            expected += f" (are there decimal commas? {ANNOUNCE})"
        raise FormatError("wrong number of columns", file=path, row=line, found=len(row), expected=expected)
    return tuple(row)
