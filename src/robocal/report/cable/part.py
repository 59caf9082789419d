"""Sections of the pages of cable robots from texts, pictures and rows of texts."""

from __future__ import annotations

from collections.abc import Sequence

from robocal.report.sections import Figure, Section, Table, Text

__all__ = ["part"]


def part(
    heading: str, text: str = "", figure: str = "", table: Sequence[Sequence[str]] = (), *, folded: bool = False
) -> Section:
    """A section of paragraphs (parted by empty lines), a picture of this folder, and a table whose first row is the header (none
    where all its cells are empty); `folded`: what a page shows on request."""
    paragraphs = (Text.of(p.strip()) for p in text.split("\n\n") if p.strip())
    header, *rows = table or [()]
    right = tuple(j for j in range(len(header)) if rows and all(_number(r[j]) for r in rows))
    shown = Table(tuple(header), tuple(map(tuple, rows)), right) if table else None
    return Section.of(heading, *paragraphs, Figure(figure) if figure else None, shown, folded=folded)


def _number(cell: str) -> bool:
    """Whether a cell is a number, with or without a unit, or stands for a missing one."""
    first = cell.replace("\u2212", "-").replace("\u00a0", " ").split(" ")[0].rstrip("%°")
    try:
        float(first.split("·")[0])
    except ValueError:
        return cell in ("", "–")
    return True
