"""Sections as plain text, for `print` and `repr`: tables in columns, no colours, no width to respect."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import assert_never

from robocal.report import sections as blocks
from robocal.report.sections import Block, Section, Table, word_and_style

__all__ = ["text"]


def text(sections: Iterable[Section]) -> str:
    """What sections say in brief, an empty line between them."""
    told = (s.short(verbose=False) for s in sections)
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
        case blocks.Text() | blocks.Remarks() | blocks.VerdictBlock() | blocks.Facts():
            yield from (
                " " * line.indent + "".join(word_and_style(part)[0] for part in line.parts) for line in block.lines
            )
        case blocks.Table():
            yield from _table(block)
        case blocks.Pair():
            for one in block.blocks:
                yield from _lines(one)
        case blocks.Written():
            if block.paths:
                yield f"Written{block.folder and f' to {block.folder}'}: {', '.join(p.name for p in block.paths)}"
        case blocks.Figure():
            if block.caption:
                yield f"[{block.caption}]"
        case blocks.Tiles() | blocks.Folded() | blocks.Detail():
            pass  # for pages
        case _:
            assert_never(block)


def _table(block: Table) -> Iterator[str]:
    if block.title:
        yield block.title
    rows = [[word_and_style(cell)[0] for cell in row] for row in (block.columns, *block.rows)]
    widths = [max(len(row[i]) for row in rows) for i in range(len(block.columns))]
    for row in rows:
        cells = (
            c.rjust(w) if i in block.right else c.ljust(w) for i, (c, w) in enumerate(zip(row, widths, strict=True))
        )
        yield "  ".join(cells).rstrip()
    if block.rest:
        yield block.rest
