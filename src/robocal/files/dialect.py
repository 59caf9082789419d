"""How a table is written: its separator, its decimal sign, the sign between thousands, the lines before its header, its comments.

What a data file states counts. Else the table decides, where all of it says the same: a decimal comma is read where some number can
mean nothing else (`-0,75`, `2.784,7140`) and none has a decimal point. `29,323` alone may be 29323, so it decides nothing.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from robocal._record import record
from robocal.errors import FormatError
from robocal.files.text import meant
from robocal.files.units import is_unit

__all__ = [
    "ANNOUNCE",
    "COMMA",
    "SEPARATORS",
    "Numbers",
    "commented_header",
    "content_lines",
    "find_header",
    "find_numbers",
    "find_separator",
    "plain_minus",
    "units_row",
]

SEPARATORS = {";": "';'", "\t": "a tab", ",": "','", " ": "a space", "|": "'|'"}
ANNOUNCE = "a data file can announce them, csv: {separator: ..., decimal: ','}"
COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
COMMENTS = ("#", "//", "%")
THOUSANDS = (".", ",", "'", "’", " ", "\u00a0", "\u202f")
TITLES = 40  # lines, at most, that may stand before a header
NAMED = 0.6  # of the columns, at least, have a name in a header; a title has one cell or two
_SEPARATOR_LINE = re.compile(r"\"?sep=(.)\"?[\s;,]*", re.IGNORECASE)
_NUMBER = re.compile(r"[+-]?[\d.,'’ \u00a0\u202f]*\d[\d.,]*(?:[eE][+-]?\d+)?")
_TEXT = re.compile(r"[^\d\s.,;'’eE+-]")
# Signs between thousands; each form begins with its letter, which is found fast.
_SPACED, _DOTTED = re.compile(r" (?<=\d )\d{3}"), re.compile(r"\.\d{3}\.\d{3}")
_MINUS = re.compile(r"(?:(?<=\d[eE])|(?<![^\s;,|\"]))\u2212(?=[.,\d])")  # U+2212 before a number or in its exponent


@record
class Numbers:
    """How numbers are written: the decimal sign, and the one between thousands (empty without)."""

    decimal: str = "."
    thousands: str = ""

    @property
    def plain(self) -> bool:
        """Whether Python reads them as they are."""
        return self.decimal == "." and not self.thousands

    def translate(self, cell: str) -> str:
        """The same number with a decimal point. A sign between digits that are no thousands stays, so that it is no number."""
        cell = cell.strip()
        if self.thousands and self.thousands in cell:
            whole, point, rest = cell.partition(self.decimal)
            if _thousands(self.thousands).fullmatch(whole) and self.thousands not in rest:
                cell = whole.replace(self.thousands, "") + point + rest
        return cell if self.decimal == "." else cell.replace(".", "?").replace(self.decimal, ".")

    def translate_all(self, cells: Sequence[str]) -> tuple[str, ...]:
        """The cells of a column, translated at once where no sign between thousands stands in them."""
        text = "\n".join(cells)
        if text.count("\n") != len(cells) - 1 or (self.thousands and self.thousands in text):
            return tuple(map(self.translate, cells))
        if self.decimal != ".":
            text = text.replace(".", "?").replace(self.decimal, ".")
        return tuple(map(str.strip, text.split("\n")))


PLAIN = Numbers()


def _thousands(sign: str) -> re.Pattern[str]:
    return re.compile(rf"[+-]?[1-9]\d{{0,2}}(?:{re.escape(sign)}\d{{3}})+")


def content_lines(text: str) -> tuple[list[tuple[int, str]], str | None]:
    """The lines that say something, with their numbers from 1, and the separator of a `sep=` line as Excel writes it."""
    numbered = enumerate(text.split("\n"), start=1)
    kept = [(i, line) for i, line in numbered if line.strip(" \t;,|") and not line.lstrip().startswith(COMMENTS)]
    stated = _SEPARATOR_LINE.fullmatch(kept[0][1].strip(" \t")) if kept else None
    return (kept[1:], stated[1]) if stated else (kept, None)


def plain_minus(text: str) -> str:
    """The same with a plain sign where a typographic minus (U+2212) begins a number or its exponent."""
    return _MINUS.sub("-", text) if "\u2212" in text else text


def commented_header(text: str, kept: Sequence[tuple[int, str]], separator: str | None) -> tuple[int, str] | None:
    """The line right before the first row where it is a header behind a comment sign, as `%time,field.x` of a recording is: it names as
    many columns as that row, which is of numbers, has."""
    number, first = kept[0]
    before = text.split("\n", number)[number - 2].strip() if number > 1 else ""
    sign = next((sign for sign in COMMENTS if before.startswith(sign)), None)
    if sign is None:
        return None
    separator = separator or find_separator(first)
    split = None if separator == " " else separator
    line = before.removeprefix(sign).strip()
    names, cells = ([cell.strip(' "') for cell in part.strip().split(split)] for part in (line, first))
    if len(names) != len(cells) or len(cells) < 2 or not all(map(_TEXT.search, names)):
        return None
    if 2 * sum(_NUMBER.fullmatch(cell) is not None for cell in cells) <= len(cells):
        return None
    # The clock of a recording counts nanoseconds.
    return number - 1, line.replace("time", "time [ns]", 1) if sign == "%" and names[0] == "time" else line


def find_separator(line: str) -> str:
    """The separator of a line: a semicolon or a tab settles it, then the comma, then spaces."""
    bare = re.sub(r"\[[^\[\]]*\]|\"[^\"]*\"", "", line)
    return next((s for s in (";", "\t", ",", "|") if s in bare), " " if " " in bare.strip() else ",")


def find_header(lines: Sequence[str], separator: str | None = None) -> int:
    """The index of the header: the first of the lines in which most columns have a name; before it stand titles."""
    few = lines[: TITLES + 1]
    if len(few) < 3:
        return 0
    separator = separator or find_separator(few[-1])
    count = [sum(bool(cell.strip(' "')) for cell in line.split(separator)) for line in few]
    usual = Counter(count[1:]).most_common(1)[0][0]
    at = next((i for i, n in enumerate(count) if n >= max(2, NAMED * usual)), 0)
    return at if _TEXT.search(few[at]) and all(n <= max(1, usual // 3) for n in count[:at]) else 0


def units_row(cells: Sequence[str]) -> tuple[str | None, ...] | None:
    """The units in a second line of a header, `mm` or `[mm]`; None where some cell is none."""
    bare = [cell.strip().removeprefix("[").removesuffix("]") for cell in cells]
    if (
        not any(bare)
        or not all(not cell or is_unit(cell) for cell in bare)
        or all(cell in ("", "1", "-") for cell in bare)
    ):
        return None
    return tuple(cell or None for cell in bare)


def find_numbers(cells: Iterable[str], decimal: str | None, thousands: str | None) -> Numbers:
    """How the numbers among some cells are written; what is stated is not asked for."""
    if decimal is None and thousands in (".", ","):
        decimal = "," if thousands == "." else "."  # a sign cannot be both
    if decimal is not None and thousands is not None:
        return Numbers(decimal, thousands)
    seen = list(filter(_NUMBER.fullmatch, map(str.strip, cells)))
    found = decimal or _decimal(seen)
    between = _between(seen, found) if thousands is None else thousands
    return Numbers(found, between)


def may_be_foreign(text: str, separator: str, decimal: str | None) -> bool:
    """Whether some number of a table may be written otherwise than Python reads it: it has a comma that separates no cells, or a sign
    between thousands."""
    return (
        decimal == ","
        or (decimal is None and (separator != "," or '"' in text) and "," in text)
        or any(sign in text for sign in "'’\u00a0\u202f")
        or (separator != " " and _SPACED.search(text) is not None)
        or _DOTTED.search(text) is not None
    )


def two_meanings(columns: Iterable[Iterable[str]]) -> bool:
    """Whether the dots of a table may stand between thousands: each has three digits behind it, and in some column whole numbers stand
    beside, `1.770` and `673`."""
    found = False
    for cells in columns:
        dotted = [cell for cell in cells if "." in cell]
        if not all(_thousands(".").fullmatch(cell.strip()) for cell in dotted):
            return False
        found |= bool(dotted) and any(cell.strip().lstrip("+-").isdigit() for cell in cells)
    return found


def _decimal(cells: Sequence[str]) -> str:
    """The decimal comma where some cell can mean nothing else and none has a decimal point; else the point. Of two commas in a number
    neither is the decimal one, nor of two dots."""
    comma = any(("," in c and _ends(c, ",")) or _parts(c, ".") for c in cells)
    return (
        ","
        if comma and not any(_ends(c, ".") or _parts(c, ",") for c in cells if "." in c or c.count(",") > 1)
        else "."
    )


def _parts(cell: str, sign: str) -> bool:
    """Whether a sign stands between thousands more than once."""
    return cell.count(sign) > 1 and _thousands(sign).fullmatch(cell) is not None


def _ends(cell: str, sign: str) -> bool:
    """Whether this sign can only be the decimal one of a number: no other follows, and the digits are no thousands."""
    other = "," if sign == "." else "."
    return (
        cell.rfind(sign) > cell.rfind(other)
        and cell.count(sign) == 1
        and (other in cell or not _thousands(sign).fullmatch(cell))
    )


def _between(cells: Sequence[str], decimal: str) -> str:
    """The sign between thousands: one that stands before a decimal sign in some cell, or can be nothing else."""
    there = set("".join(cells))
    for sign in [s for s in THOUSANDS if s != decimal and s in there]:
        whole = re.compile(rf"{_thousands(sign).pattern}{re.escape(decimal)}\d+")
        if any(whole.fullmatch(c) or _parts(c, sign) for c in cells):
            return sign
    return ""


def split_unit(header: str) -> tuple[str, str | None]:
    """The name in a header and its unit: `q1 [deg]`, `x (mm)`."""
    header = meant(header.strip())
    name, bracket, unit = header.rpartition("[")
    if bracket and unit.endswith("]") and "]" not in unit[:-1]:
        return name.strip(), unit[:-1].strip()
    name, bracket, unit = header.rpartition("(")
    if bracket and name.strip() and unit.endswith(")") and is_unit(unit[:-1].strip()):
        return name.strip(), unit[:-1].strip()
    return header, None


def is_bare(text: str, separator: str) -> bool:
    """Whether cells are all that stands between separators: nothing is quoted, and none begins with a blank."""
    return not text.startswith(" ") and not any(sign in text for sign in ('"', f"{separator} ", "\n "))


def split_columns(
    kept: list[tuple[int, str]], separator: str, width: int, path: Path, decimal: str, rows: list[list[str]] | None
) -> tuple[tuple[str, ...], ...]:
    """The cells of lines by column; `rows` are their cells, None of bare ones.

    Of those no list of a row is made: lists that go again among cells leave holes, and names in these hold the memory of a whole table.
    """
    if rows is None:
        texts = [line.strip() if separator == " " else line for _, line in kept]
        if {text.count(separator) for text in texts} == {width - 1} and max(map(len, texts)) <= csv.field_size_limit():
            every = separator.join(texts).split(separator)
            return tuple(tuple(every[i::width]) for i in range(width))
        rows = split_rows(kept, separator, path)
    if set(map(len, rows)) != {width}:
        told = zip(rows, kept, strict=True)
        rows = [_fit_row(row, width, line, path, separator, decimal) for row, (line, _) in told]
    return tuple(zip(*rows, strict=True))


def split_rows(kept: list[tuple[int, str]], separator: str, path: Path) -> list[list[str]]:
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


def _fit_row(row: list[str], width: int, line: int, path: Path, separator: str, decimal: str) -> list[str]:
    """A row of exactly `width` cells; an empty last cell behind a trailing separator is dropped."""
    while len(row) > width and not row[-1].strip():
        row = row[:-1]
    if len(row) != width:
        expected = f"{width} columns, separated by {SEPARATORS.get(separator, repr(separator))}"
        if separator == "," and decimal == "." and len(row) > width:
            expected += f" (are there decimal commas? {ANNOUNCE})"
        raise FormatError("wrong number of columns", file=path, row=line, found=len(row), expected=expected)
    return row
