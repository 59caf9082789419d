"""Sections as HTML: what pages and notebooks show. Text is escaped; figures are SVG of this package and go in as they are."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from typing import assert_never

from robocal.report import sections as blocks
from robocal.report.numbers import MISSING, align, power_of_ten
from robocal.report.sections import Block, Cell, Mark, Noted, Section, Table, word_and_style

__all__ = ["html"]

KEYS = {
    "before": '<circle class="mark before" r="4.5"/>',
    "after": '<circle class="mark after" r="4"/>',
    "held": '<path class="mark held" d="M0-6l6 6l-6 6l-6-6z"/>',
    "aside": '<path class="mark aside" d="M-4.5-4.5l9 9m0-9l-9 9"/>',
}
SIGNS = {
    "good": ("improved", '<path d="M7.5 12.5l3 3l6-7"/>'),
    "doubtful": ("not-improved", '<path d="M7.5 12h9"/>'),
    "bad": ("refused", '<path d="M8.5 8.5l7 7m0-7l-7 7"/>'),
}
UNKNOWN = ("unknown", '<path d="M12 7v6m0 4v.1"/>')
TAGS = {"strong": "strong", "term": "dfn", "code": "code"}
DENSE = 8  # columns of a table in smaller print
LONG, SHOWN = 20, 12  # rows of a table that is shown whole, and of a longer one before the others are asked for
CARDS = 4  # columns that a phone has room for; rows of more become cards
STYLE = re.compile(r"<style>.*?</style>", re.DOTALL)
NUMBER = re.compile(r"[+-]?\d[\d.]*(e[+-]\d+)?")


def html(sections: Iterable[Section], key: str = "part") -> str:
    """All sections, each a <section> with a heading where it has one; `key` begins the identifiers of those that have no name
    of their own, and is to be its own where several results stand on one page."""
    parts = (_section(s.key or f"{key}-{i}", s) for i, s in enumerate(sections))
    return "\n".join(part for part in parts if part)


def _section(name: str, section: Section) -> str:
    heading = section.title or section.heading
    told = f' id="{name}" aria-labelledby="{name}-title"' if heading else ""
    head = [f'<h2 id="{name}-title">{escape(heading)}</h2>'] if heading else []
    body = list(_blocks(section.blocks, heading))
    return "\n".join([f"<section{told}>", *head, *body, "</section>"]) if body else ""


def _blocks(found: Iterable[Block | None], heading: str = "") -> Iterator[str]:
    for block in found:
        if block is not None:
            yield from _block(block, heading)


def _block(block: Block, heading: str) -> Iterator[str]:
    match block:
        case blocks.Text():
            quiet = all(word_and_style(p)[1] == "quiet" for p in block.parts)
            words = "".join(escape(word_and_style(p)[0]) if quiet else _word(p) for p in block.parts)
            yield f'<p class="note">{words}</p>' if quiet else f"<p>{words}</p>"
        case blocks.Table():
            yield _table(block.full, heading)
        case blocks.Remarks():
            said = (f"<li>{escape(s.sentence)}{_soft(s.advice)}</li>" for s in block.messages)
            yield f"<ul>{''.join(said)}</ul>"
        case blocks.VerdictBlock():
            yield _verdict(block)
        case blocks.Tiles():
            yield f'<div class="tiles" role="group" aria-label="The numbers to see first">{"".join(_tiles(block))}</div>'
        case blocks.Facts():
            pairs = (f"<dt>{escape(k)}</dt><dd>{escape(v)}</dd>" for k, v in block.pairs)
            yield f'<dl class="kv">{"".join(pairs)}</dl>'
        case blocks.Written():
            if block.paths:
                names = ", ".join(escape(p.name) for p in block.paths)
                place = block.folder and f" to <code>{escape(block.folder)}</code>"
                yield f"<p>Written{place}: {names}</p>"
        case blocks.Figure():
            yield _figure(block, heading)
        case blocks.Pair():
            inner = ("\n".join(_block(b, heading)) for b in block.blocks)
            yield f'<div class="pair">{"".join(f"<div>{b}</div>" for b in inner)}</div>'
        case blocks.Folded():
            inside = "\n".join(_blocks(block.blocks, block.summary))
            yield f"<details><summary>{escape(block.summary)}</summary>{inside}</details>"
        case blocks.Detail():
            yield from _blocks(block.make(), heading)
        case _:
            assert_never(block)


def _verdict(block: blocks.VerdictBlock) -> str:
    kind, sign = SIGNS.get(block.style, UNKNOWN)
    icon = f'<svg viewBox="0 0 24 24" aria-hidden="true"><circle cx="12" cy="12" r="10"/>{sign}</svg>'
    why = "" if len(block.reasons) == 1 and not block.advice else "Why"
    lists = (
        f"{f'<h3>{title}</h3>' if title else ''}<ul>{''.join(f'<li>{escape(line)}</li>' for line in lines)}</ul>"
        for title, lines in ((why, block.reasons), ("What to do next", block.advice))
        if lines
    )
    meaning = f'<p class="lead">{escape(block.meaning)}</p>' if block.meaning else ""
    proof = f"<p>{escape(block.proof)}</p>" if block.proof else ""
    word = escape(block.word[:1].upper() + block.word[1:])
    return f'<div class="verdict {kind}"><h2>{icon}{word}</h2>{meaning}{proof}{"".join(lists)}</div>'


def _tiles(block: blocks.Tiles) -> Iterator[str]:
    for tile in block.tiles:
        big = f'<div class="number">{_typeset(tile.number)}<small>{escape(tile.unit)}</small></div>'
        number = big if tile.number else ""
        lines = "".join(f'<p class="{"small" if number else "none"}">{escape(line)}</p>' for line in tile.lines)
        yield f'<div class="tile {tile.mark}"><div class="name">{_key(tile.mark)}{escape(tile.name)}</div>{number}{lines}</div>'


def _figure(block: blocks.Figure, heading: str) -> str:
    title = f"<h3>{escape(block.title)}</h3>" if block.title and block.title != heading else ""
    legend = "".join(f"<li>{_key(mark)}{escape(name)}</li>" for mark, name in block.legend)
    keys = f'<ul class="legend" aria-label="Legend">{legend}</ul>' if legend else ""
    caption = f"<figcaption>{escape(block.caption)}</figcaption>" if block.caption else ""
    # A picture that stands alone has a style of its own; here the page has it, and a strict policy lets no other pass.
    return f'<figure>{title}<div class="scroll">{STYLE.sub("", block.svg)}</div>{keys}{caption}</figure>'


def _key(mark: Mark) -> str:
    return f'<svg class="key" viewBox="-7 -7 14 14" aria-hidden="true">{KEYS[mark]}</svg>' if mark in KEYS else ""


def _soft(advice: str) -> str:
    return f' <span class="soft">{escape(advice)}</span>' if advice else ""


def _word(cell: Cell) -> str:
    word, style = word_and_style(cell)
    if isinstance(cell, Noted):
        shown = cell.svg or _key(cell.mark) + _word((word, style))
        return shown + (f'<span class="soft">{escape(cell.note)}</span>' if cell.note else "")
    if not style or not word:
        return escape(word)
    if style in TAGS:
        return f"<{TAGS[style]}>{escape(word)}</{TAGS[style]}>"
    return f'<span class="{"soft" if style == "quiet" else style}">{escape(word)}</span>'


def _table(block: Table, heading: str) -> str:
    """A table; of a long one the first rows, and the others on request."""
    kinds = [' class="n"' if i in block.right else "" for i in range(len(block.columns))]
    cards = len(block.columns) > CARDS
    names = [f' data-name="{escape(c)}"' if cards else "" for c in block.columns]
    columns = [_column([row[i] for row in block.rows], i in block.right) for i in range(len(block.columns))]
    styles = block.styles or ("",) * len(block.rows)
    # A header without a word would be read aloud as one.
    heads = (
        f'<th scope="col"{k}>{escape(c)}</th>' if c else "<td></td>" for c, k in zip(block.columns, kinds, strict=True)
    )
    titles = "".join(heads)
    head = f"<thead><tr>{titles}</tr></thead>" if any(block.columns) else ""
    body = [
        _row(row, [k + n for k, n in zip(kinds, names, strict=True)], style)
        for row, style in zip(zip(*columns, strict=True), styles, strict=True)
    ]
    label = escape(block.title or heading or block.columns[0])
    said = f"{block.title}. {block.caption}" if block.title and block.caption else block.title or block.caption
    caption = f"<caption>{escape(said)}</caption>" if said else ""
    shape = " ".join(w for w, there in (("dense", len(block.columns) > DENSE), ("cards", cards)) if there)
    dense = f' class="{shape}"' if shape else ""

    def part(rows: Sequence[str], above: str) -> str:
        inside = f"<table{dense}>{above}{head}<tbody>{''.join(rows)}</tbody></table>"
        return f'<div class="scroll" tabindex="0" role="group" aria-label="{label}">{inside}</div>'

    if len(body) <= LONG:
        return part(body, caption)
    rest = part(body[SHOWN:], "")
    more = f'<details class="rest"><summary>{len(body) - SHOWN} more rows</summary>{rest}</details>'
    return f"{part(body[:SHOWN], caption)}{more}"


def _column(cells: Sequence[Cell], numbers: bool) -> list[str]:
    """Cells as HTML; of columns of numbers decimal points stand below one another."""
    if not numbers or not all(isinstance(c, str) for c in cells):
        return [_word(c) for c in cells]
    return [escape(c) for c in align([_typeset(c) for c in cells if isinstance(c, str)])]


def _typeset(cell: str) -> str:
    """A number with minus signs and powers of ten as they are printed; any other text as it is."""
    if cell == "-":
        return MISSING
    if not NUMBER.fullmatch(cell):
        return cell
    mantissa, _, power = cell.partition("e")
    return mantissa.replace("-", "\u2212") + (power_of_ten(power) if power else "")


def _row(row: tuple[str, ...], kinds: list[str], style: str) -> str:
    first, *others = row
    cells = "".join(f"<td{k}>{c}</td>" for c, k in zip(others, kinds[1:], strict=True))
    marked = f' class="{style}"' if style else ""
    return f'<tr{marked}><th scope="row"{kinds[0]}>{first}</th>{cells}</tr>'
