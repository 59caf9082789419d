"""What a result says, whoever draws it: a page is a list of sections, a section a heading with text, tables, figures and remarks.

The terminal (`cli/draw.py`) and pages draw the same sections. Nothing here knows of colours or markup: a style is what words mean.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

from robocal.remarks.remark import Said

__all__ = [
    "Block",
    "Cell",
    "Figure",
    "Remarks",
    "Section",
    "Style",
    "Table",
    "Text",
    "Written",
    "figure",
    "quiet",
    "strong",
    "table",
]

Style = Literal["", "good", "doubtful", "bad", "strong", "quiet", "strange", "title"]
Cell: TypeAlias = "str | tuple[str, Style]"


@dataclass(frozen=True)
class Text:
    """A paragraph of parts, each a string or a string with its style; `indent` in characters."""

    parts: tuple[Cell, ...]
    indent: int = 0

    @classmethod
    def of(cls, *parts: Cell, indent: int = 0) -> Text:
        """A paragraph from its parts."""
        return cls(parts, indent)


@dataclass(frozen=True)
class Table:
    """Rows under a header; columns in `right` hold numbers; a style may be given for every row."""

    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    right: tuple[int, ...] = ()
    title: str = ""
    styles: tuple[Style, ...] = ()


@dataclass(frozen=True)
class Figure:
    """A picture as SVG, and what it shows."""

    svg: str
    caption: str = ""


@dataclass(frozen=True)
class Remarks:
    """What is worth knowing: sentences, each with what to do about it."""

    said: tuple[Said, ...]


@dataclass(frozen=True)
class Written:
    """Files that were written, in one folder or one by one."""

    paths: tuple[Path, ...]


Block: TypeAlias = "Text | Table | Figure | Remarks | Written"


@dataclass(frozen=True)
class Section:
    """Blocks under a heading, which may be empty."""

    heading: str
    blocks: tuple[Block, ...]

    @classmethod
    def of(cls, heading: str, *blocks: Block | None) -> Section:
        """A section of those blocks that are there."""
        return cls(heading, tuple(b for b in blocks if b is not None))


def quiet(*lines: str, indent: int = 0) -> tuple[Text, ...]:
    """Lines that matter less than the others."""
    return tuple(Text(((line, "quiet"),), indent) for line in lines)


def strong(line: str) -> Text:
    """A line that matters more."""
    return Text(((line, "strong"),))


def table(
    *columns: str,
    right: Sequence[int] = (),
    title: str = "",
    rows: Iterable[Sequence[Cell]] = (),
    styles: Sequence[Style] = (),
) -> Table:
    """A table from whatever holds its rows."""
    return Table(columns, tuple(tuple(row) for row in rows), tuple(right), title, tuple(styles))


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
