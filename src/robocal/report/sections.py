"""The content of a result, for any display: a page is a list of sections, a section a heading with text, tables, figures and remarks.

The terminal (`cli/draw.py`), pages and notebooks (`html.py`) and plain text (`plain_text.py`) draw the same sections. What only a page
has room for is a `Detail`; what a terminal says unless more is asked for is a section's `brief`; what only specialists read a page folds
(`folded`). Nothing here knows of colours or markup: a style is what words mean.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from robocal._record import record, replace
from robocal.quantities import Listing
from robocal.remarks.remark import Message
from robocal.report.cells import Cell, Mark, Noted, Style, cell_of, figure, singular_cell, word_and_style

__all__ = [
    "OWN_FITTED",
    "SPREAD", "Block", "Cell", "Detail", "Facts", "Figure", "Folded", "Mark", "Noted", "Pair", "Remarks", "Section", "Sentence",
    "Style", "Table", "Text", "Tile", "Tiles", "VerdictBlock", "Written", "ends", "figure", "listing_table",
    "messages", "quiet", "spread", "strong", "table", "word_and_style",
]  # fmt: skip

OWN_FITTED = "own frames fitted"  # to the rows whose errors are told: poses and instruments met only there
SPREAD = ("mean", "rms", "95 %", "max", "n")


@record
class Text:
    """A paragraph of parts, each a string or a string with its style; `indent` in characters."""

    parts: tuple[Cell, ...]
    indent: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "parts", tuple(map(singular_cell, self.parts)))

    @classmethod
    def of(cls, *parts: Cell, indent: int = 0) -> Text:
        """A paragraph from its parts."""
        return cls(parts, indent)

    @property
    def lines(self) -> tuple[Text, ...]:
        """What a terminal shows of a block without columns."""
        return (self,)


@record
class Table:
    """Rows under a header; columns in `right` hold numbers; a style may be given for every row. Only pages have room for the
    columns in `detail`, for rows after the first `brief`, and for the caption; they leave out the columns in `terse`, which
    others say at more length."""

    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    right: tuple[int, ...] = ()
    title: str = ""
    styles: tuple[Style, ...] = ()
    caption: str = ""
    detail: tuple[int, ...] = ()
    terse: tuple[int, ...] = ()
    brief: int | None = None
    omitted: int = 0

    @property
    def short(self) -> Table:
        """The same where there is little room, and how many rows it lacks."""
        omitted = 0 if self.brief is None else max(0, len(self.rows) - self.brief)
        return replace(self, omitted=omitted, rows=self.rows[: self.brief], styles=self.styles[: self.brief]).without(
            self.detail
        )

    @property
    def rest(self) -> str:
        """How many rows there are besides those that it has."""
        return f"and {self.omitted} more" if self.omitted else ""

    @property
    def full(self) -> Table:
        """The same where there is room."""
        return self.without(self.terse)

    def without(self, columns: Sequence[int]) -> Table:
        """The same without these columns."""
        kept = [i for i in range(len(self.columns)) if i not in columns]
        right, detail, terse = (
            tuple(k for k, i in enumerate(kept) if i in those) for those in (self.right, self.detail, self.terse)
        )
        heads, rows = tuple(self.columns[i] for i in kept), tuple(tuple(row[i] for i in kept) for row in self.rows)
        return replace(self, columns=heads, rows=rows, right=right, detail=detail, terse=terse)


@record
class Figure:
    """A picture as SVG, and what it shows; a legend names its marks."""

    svg: str
    caption: str = ""
    title: str = ""
    legend: tuple[tuple[Mark, str], ...] = ()


@record
class Remarks:
    """What is worth knowing: sentences, each with what to do about it."""

    messages: tuple[Message, ...]

    @property
    def lines(self) -> tuple[Text, ...]:
        """Each sentence, and below it the advice."""
        return tuple(
            line
            for said in self.messages
            for line in (Text.of(said.sentence, indent=2), *(quiet(said.advice, indent=4) if said.advice else ()))
        )


@record
class VerdictBlock:
    """A judgement: its word, what it means, what was proven, why, and what to do next."""

    word: str
    style: Style
    reasons: tuple[str, ...] = ()
    advice: tuple[str, ...] = ()
    meaning: str = ""
    proof: str = ""

    @property
    def lines(self) -> tuple[Text, ...]:
        """Word and reasons in one line, and below it what was proven and what to do."""
        head = Text.of((self.word.upper(), self.style), f"  {'; '.join(self.reasons)}" if self.reasons else "")
        return head, *quiet(*(t for t in (self.proof, *self.advice) if t), indent=2)


@record
class Tile:
    """A number that is to be seen first, and lines below it."""

    name: str
    mark: Mark
    number: str
    unit: str
    lines: tuple[str, ...] = ()


@record
class Tiles:
    """Big numbers side by side; a table says them too."""

    tiles: tuple[Tile, ...]


@record
class Facts:
    """Names with their values."""

    pairs: tuple[tuple[str, str], ...]

    @property
    def lines(self) -> tuple[Text, ...]:
        """One for each name."""
        return tuple(Text.of(f"{name}: {value}") for name, value in self.pairs)


@record
class Written:
    """Files that were written, in one folder or one by one."""

    paths: tuple[Path, ...]

    @property
    def folder(self) -> str:
        """Where they are, if not here."""
        return "" if self.paths[0].parent == Path() else str(self.paths[0].parent)


@record
class Pair:
    """Blocks side by side, where there is room."""

    blocks: tuple[Block, ...]


@record
class Folded:
    """Blocks that open on request."""

    summary: str
    blocks: tuple[Block, ...]


@record
class Detail:
    """What only a page has room for; made when one is drawn."""

    make: Callable[[], Iterable[Block | None]]


Block: TypeAlias = "Text | Table | Figure | Remarks | VerdictBlock | Tiles | Facts | Written | Pair | Folded | Detail"


@record
class Section:
    """Blocks under a heading, which may be empty; pages may have one of their own (`title`), and a name to be found by (`key`). `brief`:
    what a terminal says in place of the blocks, without the heading, unless more is asked for. `folded`: pages show it on request."""

    heading: str
    blocks: tuple[Block, ...]
    title: str = ""
    key: str = ""
    brief: tuple[Block, ...] | None = None
    folded: bool = False

    @classmethod
    def of(
        cls,
        heading: str,
        *blocks: Block | None,
        title: str = "",
        key: str = "",
        brief: Iterable[Block | None] | None = None,
        folded: bool = False,
    ) -> Section:
        """A section of those blocks that are there."""
        less = None if brief is None else tuple(b for b in brief if b is not None)
        return cls(heading, tuple(b for b in blocks if b is not None), title, key, less, folded)

    def short(self, verbose: bool) -> Section | None:
        """The same where there is little room; None where nothing is left of it."""
        if self.brief is not None and not verbose:
            return (
                Section("", tuple(b.short if isinstance(b, Table) else b for b in self.brief)) if self.brief else None
            )
        kept = tuple(b for b in self.blocks if not isinstance(b, Detail | Tiles | Folded))
        if not kept and (self.blocks or not self.heading):
            return None
        return Section(self.heading, tuple(b.short if isinstance(b, Table) else b for b in kept))


def ends(remarks: Sequence[Message] = (), written: Sequence[Path] = (), key: str = "") -> Iterator[Section]:
    """What stands at the end: what is worth knowing, and the files that were written."""
    if remarks:
        yield Section.of("Worth knowing", Remarks(tuple(remarks)), key=key)
    if written:
        yield Section.of("", Written(tuple(written)))


@record
class Sentence:
    """A remark as a document keeps it."""

    sentence: str
    advice: str = ""


def messages(document: Any, said: Sequence[str]) -> list[Message]:
    """The remarks of a document that have these sentences."""
    advice = {r["sentence"]: r.get("advice", "") for r in document.remarks}
    return [Sentence(s, advice.get(s, "")) for s in said]


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
    caption: str = "",
    detail: Sequence[int] = (),
    terse: Sequence[int] = (),
    brief: int | None = None,
) -> Table:
    """A table from whatever holds its rows."""
    made = tuple(tuple(row) for row in rows)
    return Table(columns, made, tuple(right), title, tuple(styles), caption, tuple(detail), tuple(terse), brief)


def listing_table(listing: Listing, *, title: str = "", most: int | None = None, styles: Sequence[Style] = ()) -> Table:
    """A table of a listing, or of its first rows, as the columns say that they are shown."""
    values = [c.plain[:most] for c in listing.columns]
    numbers = tuple(i for i, column in enumerate(values) if any(isinstance(v, int | float) for v in column))
    cells = [[cell_of(v, c) for v in column] for c, column in zip(listing.columns, values, strict=True)]
    heads = tuple(c.label or c.header for c in listing.columns)
    return Table(heads, tuple(zip(*cells, strict=True)), numbers, title, tuple(styles))


def spread(s: Any) -> tuple[str, ...]:
    """A statistic as the cells of a table, under SPREAD."""
    return (*(figure(v) for v in (s.mean, s.rms, s.p95, s.max)), str(s.n))
