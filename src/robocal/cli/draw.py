"""Sections on the terminal: text, tables, remarks with their advice, and where files are."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, assert_never

from rich.console import RenderableType
from rich.padding import Padding
from rich.text import Text as Rich

from robocal.cli.tables import PlainTable
from robocal.report import sections as blocks

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


def drawn(sections: Iterable[blocks.Section]) -> Iterator[RenderableType]:
    """Sections one below the other, an empty line between them, as rich prints them."""
    told = (s.short for s in sections)
    for i, section in enumerate(s for s in told if s is not None):
        if i:
            yield Rich("")
        if section.heading:
            yield Rich(section.heading, style="bold")
        for before, block in zip((None, *section.blocks), section.blocks, strict=False):
            if isinstance(before, blocks.Table) and isinstance(block, blocks.Table):
                yield Rich("")  # or two tables would look like one
            yield from _drawn(block)


def _drawn(block: blocks.Block) -> list[Any]:
    match block:
        case blocks.Text():
            line = Rich.assemble(*(part if isinstance(part, str) else _style_of(part) for part in block.parts))
            return [_indent(line, block.indent) if block.indent else line]
        case blocks.Table():
            return [_table(block)]
        case blocks.Remarks():
            return [part for said in block.messages for part in _remark(said)]
        case blocks.Written():
            return [_paths(block)] if block.paths else []
        case blocks.VerdictBlock():
            word = Rich.assemble((block.word.upper(), STYLES[block.style]), block.line[len(block.word) :])
            return [word, *(_indent(Rich(t, style="dim"), 2) for t in block.below)]
        case blocks.Facts():
            return [Rich(f"{name}: {value}") for name, value in block.pairs]
        case blocks.Pair():
            return [part for one in block.blocks for part in _drawn(one)]
        case blocks.Figure() | blocks.Tiles() | blocks.Folded() | blocks.Detail():
            return []  # for pages
        case _:
            assert_never(block)


def _indent(text: Rich, by: int) -> Padding:
    return Padding(text, (0, 0, 0, by), expand=False)


def _remark(said: Any) -> list[Padding]:
    advice = [_indent(Rich(said.advice, style="dim"), 4)] if said.advice else []
    return [_indent(Rich(said.sentence), 2), *advice]


def _style_of(cell: tuple[str, blocks.Style] | blocks.Noted) -> tuple[str, str]:
    word, style = (cell.word, cell.style) if isinstance(cell, blocks.Noted) else cell
    return word, STYLES[style]


def _table(block: blocks.Table) -> PlainTable:
    made = PlainTable(*block.columns, right=block.right, title=block.title)
    styles = block.styles or ("",) * len(block.rows)
    for row, style in zip(block.rows, styles, strict=True):
        made.add_row(*(cell if isinstance(cell, str) else Rich(*_style_of(cell)) for cell in row), style=STYLES[style])
    return made


def _paths(block: blocks.Written) -> Rich:
    """Where the files are; the report first, because that is what people open."""
    ordered = sorted(block.paths, key=lambda p: (p.name != "report.html", p.name))
    return Rich(f"Written to {ordered[0].parent}: {', '.join(p.name for p in ordered)}")
