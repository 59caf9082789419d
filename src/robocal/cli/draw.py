"""Sections on the terminal: text, tables, remarks with their advice, and where files are."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, assert_never

from rich.console import RenderableType
from rich.padding import Padding
from rich.text import Text as Rich

from robocal.cli.tables import PlainTable
from robocal.report.sections import (
    Block,
    Cell,
    Detail,
    Facts,
    Figure,
    Folded,
    Noted,
    Pair,
    Remarks,
    Section,
    Style,
    Table,
    Text,
    Tiles,
    VerdictBlock,
    Written,
)

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
        case Text():
            line = Rich.assemble(*map(_part, block.parts))
            return [Padding(line, (0, 0, 0, block.indent), expand=False) if block.indent else line]
        case Table():
            return [_table(block)]
        case Remarks():
            return [part for said in block.messages for part in _remark(said)]
        case Written():
            return [_paths(block)] if block.paths else []
        case VerdictBlock():
            word = Rich.assemble((block.word.upper(), STYLES[block.style]), block.line[len(block.word) :])
            return [word, *(Padding(Rich(t, style="dim"), (0, 0, 0, 2), expand=False) for t in block.below)]
        case Facts():
            return [Rich(f"{name}: {value}") for name, value in block.pairs]
        case Pair():
            return [part for one in block.blocks for part in _drawn(one)]
        case Figure() | Tiles() | Folded() | Detail():
            return []  # for pages
        case _:
            assert_never(block)


def _part(cell: Cell) -> Any:
    return cell if isinstance(cell, str) else _style_of(cell)


def _style_of(cell: tuple[str, Style] | Noted) -> tuple[str, str]:
    word, style = (cell.word, cell.style) if isinstance(cell, Noted) else cell
    return word, STYLES[style]


def _cell(cell: Cell) -> Any:
    if isinstance(cell, str):
        return cell
    word, style = _style_of(cell)
    return Rich(word, style=style)


def _table(block: Table) -> PlainTable:
    made = PlainTable(*block.columns, right=block.right, title=block.title)
    styles = block.styles or ("",) * len(block.rows)
    for row, style in zip(block.rows, styles, strict=True):
        made.add_row(*map(_cell, row), style=STYLES[style])
    return made


def _remark(said: Any) -> list[Any]:
    out = [Padding(Rich(said.sentence), (0, 0, 0, 2), expand=False)]
    if said.advice:
        out.append(Padding(Rich(said.advice, style="dim"), (0, 0, 0, 4), expand=False))
    return out


def _paths(block: Written) -> Rich:
    """Where the files are; the report first, because that is what people open."""
    ordered = sorted(block.paths, key=lambda p: (p.name != "report.html", p.name))
    return Rich(f"Written to {ordered[0].parent}: {', '.join(p.name for p in ordered)}")
