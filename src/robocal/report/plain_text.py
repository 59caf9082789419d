"""Sections as plain text, for `print` and `repr`: tables in columns, no colours, no width to respect."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import assert_never

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
    Table,
    Text,
    Tiles,
    VerdictBlock,
    Written,
)

__all__ = ["text"]


def text(sections: Iterable[Section]) -> str:
    """Everything that sections say, an empty line between them."""
    told = (s.short for s in sections)
    return "\n\n".join(part for s in told if s is not None and (part := "\n".join(_section(s))))


def _section(section: Section) -> Iterator[str]:
    if section.heading:
        yield section.heading
    for before, block in zip((None, *section.blocks), section.blocks, strict=False):
        if isinstance(before, Table) and isinstance(block, Table):
            yield ""
        yield from _lines(block)


def _lines(block: Block) -> Iterator[str]:
    match block:
        case Text():
            yield " " * block.indent + "".join(map(_word, block.parts))
        case Table():
            yield from _table(block)
        case Remarks():
            for said in block.messages:
                yield f"  {said.sentence}"
                if said.advice:
                    yield f"    {said.advice}"
        case VerdictBlock():
            yield block.line
            yield from (f"  {line}" for line in block.below)
        case Facts():
            yield from (f"{name}: {value}" for name, value in block.pairs)
        case Pair():
            for one in block.blocks:
                yield from _lines(one)
        case Written():
            if block.paths:
                yield f"Written to {block.paths[0].parent}: {', '.join(p.name for p in block.paths)}"
        case Figure():
            if block.caption:
                yield f"[{block.caption}]"
        case Tiles() | Folded() | Detail():
            pass  # for pages
        case _:
            assert_never(block)


def _word(cell: Cell) -> str:
    return cell if isinstance(cell, str) else cell.word if isinstance(cell, Noted) else cell[0]


def _table(block: Table) -> Iterator[str]:
    if block.title:
        yield block.title
    rows = [tuple(map(_word, row)) for row in (block.columns, *block.rows)]
    widths = [max(len(row[i]) for row in rows) for i in range(len(block.columns))]
    for row in rows:
        cells = (
            c.rjust(w) if i in block.right else c.ljust(w) for i, (c, w) in enumerate(zip(row, widths, strict=True))
        )
        yield "  ".join(cells).rstrip()
