"""Sections on the terminal: text, tables, remarks with their advice, and where files are."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, assert_never

from rich.console import RenderableType
from rich.padding import Padding
from rich.text import Text as Rich

from robocal.cli.tables import PlainTable
from robocal.report import sections as blocks
from robocal.report.sections import Block, Cell, Section, Table, Text, word_and_style

__all__ = ["drawn"]

STYLES = {
    "": "",
    "good": "bold green",
    "doubtful": "bold yellow",
    "bad": "bold red",
    "strong": "bold",
    "quiet": "dim",
    "strange": "yellow",
    "title": "bold italic",
    "term": "bold",
    "code": "",
}


def drawn(sections: Iterable[Section]) -> Iterator[RenderableType]:
    """Sections one below the other, an empty line between them, as rich prints them."""
    told = (s.short for s in sections)
    for i, section in enumerate(s for s in told if s is not None):
        if i:
            yield Rich("")
        if section.heading:
            yield Rich(section.heading, style="bold")
        for before, block in zip((None, *section.blocks), section.blocks, strict=False):
            if isinstance(before, Table) and isinstance(block, Table):
                yield Rich("")  # or two tables would look like one
            yield from _drawn(block)


def _drawn(block: Block) -> list[Any]:
    match block:
        case blocks.Text() | blocks.Remarks() | blocks.VerdictBlock() | blocks.Facts():
            return [_line(line) for line in block.lines]
        case blocks.Table():
            return [_table(block)]
        case blocks.Written():
            return [_paths(block)] if block.paths else []
        case blocks.Pair():
            return [part for one in block.blocks for part in _drawn(one)]
        case blocks.Figure() | blocks.Tiles() | blocks.Folded() | blocks.Detail():
            return []  # for pages
        case _:
            assert_never(block)


def _line(line: Text) -> Any:
    drawn = Rich.assemble(*map(_part, line.parts))
    return Padding(drawn, (0, 0, 0, line.indent), expand=False) if line.indent else drawn


def _part(cell: Cell) -> tuple[str, str]:
    word, style = word_and_style(cell)
    return word, STYLES[style]


def _table(block: Table) -> PlainTable:
    made = PlainTable(*block.columns, right=block.right, title=block.title)
    styles = block.styles or ("",) * len(block.rows)
    for row, style in zip(block.rows, styles, strict=True):
        made.add_row(*(Rich(word, style=own) for word, own in map(_part, row)), style=STYLES[style])
    return made


def _paths(block: blocks.Written) -> Rich:
    """Where the files are; the report first, because that is what people open."""
    ordered = sorted(block.paths, key=lambda p: (p.name != "report.html", p.name))
    return Rich(f"Written to {ordered[0].parent}: {', '.join(p.name for p in ordered)}")
