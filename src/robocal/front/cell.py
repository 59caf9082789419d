"""A notebook cell of one screen: what the terminal would say, cut to so many lines, and one figure; the page has all."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from html import escape

from robocal._record import replace
from robocal.front.plots import figures
from robocal.report.page import embed
from robocal.report.sections import (
    Block,
    Facts,
    Figure,
    Pair,
    Remarks,
    Section,
    Table,
    Text,
    VerdictBlock,
    Written,
    quiet,
)

__all__ = ["LINES", "cell"]

LINES = 60  # of text in a cell: one screen
ROWS = 20  # of one table, beside others


def cell(told: Iterable[Section], whole: Iterable[Section], first: Sequence[str], raw: str | None, key: str) -> str:
    """Sections in brief with one figure of the `whole` page, as HTML of a notebook; `first` are figures to be preferred, `raw` is a text
    that stands above, `key` begins all identifiers."""
    room, above = LINES - 3, ""
    if raw is not None:
        lines = raw.rstrip().splitlines()
        shown = lines if len(lines) <= ROWS else [*lines[: ROWS - 1], f"... ({len(lines)} lines; text has all)"]
        above, room = f"<pre>{escape(chr(10).join(shown))}</pre>\n", room - len(shown)
    short = [s for s in (s.short(verbose=False) for s in told) if s is not None]
    out = [replace(s, blocks=tuple(b for b in s.blocks if not isinstance(b, Figure))) for s in short]
    out = list(_fit(out, room))
    known = dict(figures(whole))
    figure = next((known[n] for n in first if n in known), next(iter(known.values()), None))
    if figure is not None:
        out.append(Section.of("", replace(figure, caption="", title="")))
    more = f"report(file) writes the whole page{f', plot(name) gives one of {len(known)} figures' if len(known) > 1 else ''}."
    out.append(Section.of("", *quiet(more)))
    return above + embed(out, key)


def _fit(told: Iterable[Section], room: int) -> Iterator[Section]:
    """Sections that together have at most `room` lines; what has none is left out."""
    for section in told:
        kept: list[Block] = []
        room -= bool(section.heading)
        for block in section.blocks:
            cut = _cut(block, room)
            if cut is None:
                break
            kept.append(cut)
            room -= lines_of(cut)
        if kept:
            yield replace(section, blocks=tuple(kept))
        if room <= 0:
            return


def lines_of(block: Block) -> int:
    """How many lines a block has, each at least once."""
    match block:
        case Table():
            return len(block.rows) + any(block.columns) + bool(block.title or block.caption) + bool(block.rest)
        case VerdictBlock():
            return 3 + len(block.reasons) + len(block.advice) + bool(block.meaning) + bool(block.proof)
        case Remarks():
            return len(block.messages)
        case Facts():
            return 2 * len(block.pairs)
        case Pair():
            return sum(map(lines_of, block.blocks))
        case Text() | Written():
            return 1
        case _:
            return 0


def _cut(block: Block, room: int) -> Block | None:
    """A block in so many lines: of a table the first rows; None where it does not fit."""
    if isinstance(block, Table):
        most = min(ROWS, room - 3)
        if len(block.rows) > most > 0:
            left = len(block.rows) - most
            few = replace(block, rows=block.rows[:most], styles=block.styles[:most])
            return replace(few, omitted=block.omitted + left, caption=f"and {block.omitted + left} more rows")
        block = replace(block, caption=f"and {block.omitted} more rows") if block.omitted else block
    if isinstance(block, Remarks) and 0 < room < len(block.messages):
        return Remarks(block.messages[:room])
    return block if lines_of(block) <= room else None
