"""Sections on the terminal: text, tables, remarks with their advice, and where files are.

Tables keep what they say at any width: a number is never broken or cut, a word only where it is longer than most. rich narrows a table
that is too wide wherever it likes, digits included. Here the columns of words give way first, down to their longest word; where that
is not enough, every row is said in lines of text.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, assert_never

from rich import box
from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from robocal.report import sections as blocks
from robocal.report.sections import word_and_style

__all__ = ["PlainTable", "drawn"]

GAP = 3  # between two columns: a blank on either side of what would be a line
WORD = 24  # letters; longer ones, such as paths, may be folded

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


def drawn(sections: Iterable[blocks.Section], verbose: bool = False) -> Iterator[RenderableType]:
    """Sections one below the other, an empty line between them, as rich prints them; briefly unless `verbose`."""
    told = (s.short(verbose) for s in sections)
    for i, section in enumerate(s for s in told if s is not None):
        if i:
            yield Text("")
        if section.heading:
            yield Text(section.heading, style="bold")
        for before, block in zip((None, *section.blocks), section.blocks, strict=False):
            if isinstance(before, blocks.Table) and isinstance(block, blocks.Table):
                yield Text("")  # or two tables would look like one
            yield from _drawn(block)


def _drawn(block: blocks.Block) -> list[Any]:
    match block:
        case blocks.Text() | blocks.Remarks() | blocks.VerdictBlock() | blocks.Facts():
            return [_line(line) for line in block.lines]
        case blocks.Table():
            return [_table(block), *([Text(block.rest, style=STYLES["quiet"])] if block.rest else [])]
        case blocks.Written():
            return [_paths(block)] if block.paths else []
        case blocks.Pair():
            return [part for one in block.blocks for part in _drawn(one)]
        case blocks.Figure() | blocks.Tiles() | blocks.Folded() | blocks.Detail():
            return []  # for pages
        case _:
            assert_never(block)


def _line(line: blocks.Text) -> Any:
    drawn = Text.assemble(*map(_part, line.parts))
    return Padding(drawn, (0, 0, 0, line.indent), expand=False) if line.indent else drawn


def _part(cell: blocks.Cell) -> tuple[str, str]:
    word, style = word_and_style(cell)
    return word, STYLES[style]


def _table(block: blocks.Table) -> PlainTable:
    made = PlainTable(*block.columns, right=block.right, title=block.title)
    styles = block.styles or ("",) * len(block.rows)
    for row, style in zip(block.rows, styles, strict=True):
        made.add_row(*(Text(word, style=own) for word, own in map(_part, row)), style=STYLES[style])
    return made


def _paths(block: blocks.Written) -> Text:
    """Where the files are; the report first, because that is what people open."""
    ordered = sorted(block.paths, key=lambda p: (p.name != "report.html", p.name))
    return Text(f"Written{block.folder and f' to {block.folder}'}: {', '.join(p.name for p in ordered)}")


class PlainTable(Table):
    """A rule under the header and nothing else; columns in `right` hold numbers."""

    def __init__(self, *columns: str, right: Sequence[int] = (), title: str = "") -> None:
        super().__init__(
            box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, title=title or None, title_justify="left",
            title_style="bold",
        )  # fmt: skip
        self._numbers = frozenset(right)
        for i, name in enumerate(columns):
            self.add_column(name, justify="right" if i in self._numbers else "left", overflow="fold")

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        words = [[_text(console, cell) for cell in (column.header, *column.cells)] for column in self.columns]
        most = [max(t.cell_len for t in column) for column in words]
        least = [self._least(i, column) for i, column in enumerate(words)]
        room = options.max_width - GAP * (len(self.columns) - 1)
        if sum(least) > room:
            yield from self._lines(words)
            return
        for column, width in zip(self.columns, _shared(least, most, room), strict=True):
            column.width = width
        yield from super().__rich_console__(console, options)
        for column in self.columns:
            column.width = None

    def _least(self, i: int, column: Sequence[Text]) -> int:
        """The width below which something would break."""
        if i in self._numbers:
            return max(max(t.cell_len for t in column[1:]) if len(column) > 1 else 0, _longest(column[:1]))
        return _longest(column)

    def _lines(self, words: Sequence[Sequence[Text]]) -> RenderResult:
        """Every row as its first cell, and below it the others by name."""
        if self.title:
            yield Text(str(self.title), style="bold")
        heads = [column[0].plain for column in words]
        for i, row in enumerate(self.rows, start=1):
            yield Text.assemble((f"{heads[0]} " if heads[0] else "", "dim"), words[0][i], style=row.style or "")
            cells = [
                Text.assemble((f"{h} " if h else "", "dim"), c[i]) for h, c in zip(heads, words, strict=True) if c[i]
            ]
            yield Padding(Text("; ").join(cells[1:] if words[0][i] else cells), (0, 0, 0, 2))


def _text(console: Console, cell: object) -> Text:
    return cell if isinstance(cell, Text) else console.render_str(str(cell), markup=False, highlight=False)


def _longest(column: Sequence[Text]) -> int:
    """The longest word that may not be folded."""
    return max((_width(word) for t in column for word in t.plain.split()), default=0)


def _width(word: str) -> int:
    bare = word.strip("()[],;+-±").replace(",", "")
    try:
        float(bare)
    except ValueError:
        return min(Text(word).cell_len, WORD)
    return len(word)


def _shared(least: Sequence[int], most: Sequence[int], room: int) -> list[int]:
    """Widths between `least` and `most` that fill the room: the widest give way first."""
    widths = list(most)
    while sum(widths) > room:
        i = max((i for i in range(len(widths)) if widths[i] > least[i]), key=lambda i: widths[i])
        widths[i] -= 1
    return widths
