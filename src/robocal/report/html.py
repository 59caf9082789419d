"""Sections as HTML: what pages and notebooks show. Text is escaped; figures are SVG of this package and go in as they are."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from html import escape

from robocal.report.sections import Block, Cell, Figure, Remarks, Section, Table, Text, Written

__all__ = ["html"]


def html(sections: Iterable[Section], key: str = "part") -> str:
    """All sections, each a <section> with a heading where it has one; `key` begins their identifiers, which are to be its own
    where several results stand on one page."""
    return "\n".join(_section(f"{key}-{i}", s) for i, s in enumerate(sections))


def _section(name: str, section: Section) -> str:
    short = all(not isinstance(b, Table) or len(b.rows) < 20 for b in section.blocks)
    # On paper, what fits a page stays on one.
    whole = ' class="whole"' if short else ""
    told = f' aria-labelledby="{name}"' if section.heading else ""
    head = [f'<h2 id="{name}">{escape(section.heading)}</h2>'] if section.heading else []
    blocks = (part for b in section.blocks for part in _block(b, section.heading))
    return "\n".join([f"<section{told}{whole}>", *head, *blocks, "</section>"])


def _block(block: Block, heading: str) -> Iterator[str]:
    match block:
        case Text():
            yield f"<p>{''.join(map(_word, block.parts))}</p>"
        case Table():
            yield _table(block, heading)
        case Remarks():
            said = (f"<li>{escape(s.sentence)}{_soft(s.advice)}</li>" for s in block.said)
            yield f"<ul>{''.join(said)}</ul>"
        case Written():
            if block.paths:
                names = ", ".join(escape(p.name) for p in block.paths)
                yield f"<p>Written to <code>{escape(str(block.paths[0].parent))}</code>: {names}</p>"
        case Figure():
            caption = f"<figcaption>{escape(block.caption)}</figcaption>" if block.caption else ""
            yield f'<figure><div class="scroll">{block.svg}</div>{caption}</figure>'


def _soft(advice: str) -> str:
    return f' <span class="soft">{escape(advice)}</span>' if advice else ""


def _word(cell: Cell) -> str:
    if isinstance(cell, str):
        return escape(cell)
    word, style = cell
    if not style or not word:
        return escape(word)
    if style == "strong":
        return f"<strong>{escape(word)}</strong>"
    return f'<span class="{"soft" if style == "quiet" else style}">{escape(word)}</span>'


def _table(block: Table, heading: str) -> str:
    kinds = [' class="n"' if i in block.right else "" for i in range(len(block.columns))]
    styles = block.styles or ("",) * len(block.rows)
    titles = "".join(f'<th scope="col"{k}>{escape(c)}</th>' for c, k in zip(block.columns, kinds, strict=True))
    head = f"<thead><tr>{titles}</tr></thead>" if any(block.columns) else ""
    body = "".join(_row(row, kinds, style) for row, style in zip(block.rows, styles, strict=True))
    label = escape(block.title or heading or block.columns[0])
    caption = f"<caption>{escape(block.title)}</caption>" if block.title else ""
    return (
        f'<div class="scroll" tabindex="0" role="group" aria-label="{label}"><table>{caption}{head}'
        f"<tbody>{body}</tbody></table></div>"
    )


def _row(row: tuple[Cell, ...], kinds: list[str], style: str) -> str:
    first, *others = (_word(c if style == "" or not isinstance(c, str) else (c, style)) for c in row)  # type: ignore[arg-type]
    cells = "".join(f"<td{k}>{c}</td>" for c, k in zip(others, kinds[1:], strict=True))
    return f'<tr><th scope="row"{kinds[0]}>{first}</th>{cells}</tr>'
