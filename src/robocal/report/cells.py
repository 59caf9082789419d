"""Cells of tables: a word with its style or remark, and numbers as people read them."""

from __future__ import annotations

import math
from typing import Any, Literal, TypeAlias

from robocal._record import record
from robocal.quantities import Column
from robocal.remarks.remark import singular

__all__ = ["Cell", "Mark", "Noted", "Style", "cell_of", "figure", "singular_cell", "word_and_style"]

Style = Literal["", "good", "doubtful", "bad", "strong", "quiet", "strange", "title", "term", "code"]
Mark = Literal["", "before", "after", "held", "aside"]
Cell: TypeAlias = "str | tuple[str, Style] | Noted"


@record
class Noted:
    """A cell with a remark of a few words, the mark of the series that it tells of, or a picture (SVG) in place of its word."""

    word: str
    note: str = ""
    mark: Mark = ""
    style: Style = ""
    svg: str = ""


def singular_cell(cell: Cell) -> Cell:
    """A cell whose words agree with a count of one."""
    if isinstance(cell, Noted):
        return cell
    return singular(cell) if isinstance(cell, str) else (singular(cell[0]), cell[1])


def word_and_style(cell: Cell) -> tuple[str, Style]:
    """A cell without its remark."""
    return (cell, "") if isinstance(cell, str) else (cell.word, cell.style) if isinstance(cell, Noted) else cell


def cell_of(value: Any, column: Column) -> str:
    """A value as its column says that it is shown."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list) and column.spec == "to":
        return " to ".join(f"{v:g}" for v in value)
    if isinstance(value, list):
        return ", ".join(cell_of(v, column) for v in value)
    if isinstance(value, float):
        return format(value, column.spec) if column.spec and math.isfinite(value) else figure(value, column.figures)
    return "" if value is None else str(value)


def figure(value: float | None, digits: int = 4) -> str:
    """A number as people read it: significant digits, no exponent where it can be helped."""
    if value is None or not math.isfinite(value):
        return "-"
    if value == 0:
        return "0"
    size = math.floor(math.log10(abs(value)))
    if size < -6 or size > 6:
        return f"{value:.{digits - 1}e}"
    return f"{value:.{max(digits - 1 - size, 0)}f}"
