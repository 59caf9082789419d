"""The page of a cable robot: headings, words, pictures and tables in one file that needs nothing from outside."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from robocal.report.cable.paint import asset, clean
from robocal.report.page import style

__all__ = ["Block", "page"]

PRINT = "@media print { .whole { break-inside: avoid; } }\n"


@dataclass(frozen=True)
class Block:
    """A part of a page. `text`: paragraphs, parted by empty lines; `figure`: a picture of this folder, as it came; `table`: rows,
    the first of which is the header (none where all its cells are empty). Text and cells are escaped, a figure is not."""

    heading: str
    text: str = ""
    figure: str = ""
    table: Sequence[Sequence[str]] = ()


def page(title: str, blocks: Sequence[Block]) -> str:
    """The text of report.html. Its content security policy allows one script, by its hash, which turns pictures of space; without
    it they stand still."""
    name, body = escape(title), "\n".join(_section(i, b) for i, b in enumerate(blocks))
    turns = 'data-eye="' in body
    script = asset("turn.js") if turns else ""
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'" + (
        f"; script-src 'sha256-{digest}'" if turns else ""
    )
    return clean(
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n<meta name="color-scheme" content="light dark">\n'
        f'<meta name="robots" content="noindex">\n<link rel="icon" href="data:,">\n<title>{name}</title>\n'
        f"<style>\n{style()}{PRINT}</style>\n</head>\n<body>\n<main>\n"
        f'<header><p class="eyebrow">Cable robot</p><h1>{name}</h1></header>\n{body}\n'
        "<footer>Made by robocal. This page is complete in itself and contacts nothing.</footer>\n</main>\n"
        + (f"<script>{script}</script>\n" if turns else "")
        + "</body>\n</html>\n"
    )


def _section(i: int, block: Block) -> str:
    # On paper, what fits a page stays on one.
    whole = ' class="whole"' if block.figure or len(block.table) <= 20 else ""
    parts = [
        f'<section aria-labelledby="part-{i}"{whole}>',
        f'<h2 id="part-{i}">{escape(block.heading)}</h2>',
    ]
    parts += [f"<p>{escape(p.strip())}</p>" for p in block.text.split("\n\n") if p.strip()]
    if block.figure:
        parts.append(f'<figure><div class="scroll">{block.figure}</div></figure>')
    return "\n".join([*parts, _table(block), "</section>"])


def _table(block: Block) -> str:
    if not block.table:
        return ""
    header, rows = block.table[0], block.table[1:]
    numeric = [all(_number(r[j]) for r in rows if j < len(r)) and bool(rows) for j in range(len(header))]
    kind = [' class="n"' if n else "" for n in numeric] + [""] * max((len(r) for r in rows), default=0)
    titles = "".join(f'<th scope="col"{kind[j]}>{escape(c)}</th>' for j, c in enumerate(header))
    lines = [
        "<tr>"
        + "".join(
            f"<td{kind[j]}>{escape(c)}</td>" if j else f'<th scope="row"{kind[j]}>{escape(c)}</th>'
            for j, c in enumerate(row)
        )
        + "</tr>"
        for row in rows
    ]
    head = f"<thead><tr>{titles}</tr></thead>" if any(header) else ""
    return (
        f'<div class="scroll" tabindex="0" role="group" aria-label="{escape(block.heading)}"><table>'
        f"{head}<tbody>{''.join(lines)}</tbody></table></div>"
    )


def _number(cell: str) -> bool:
    """Whether a cell is a number, with or without a unit, or stands for a missing one."""
    first = cell.replace("\u2212", "-").replace("\u00a0", " ").split(" ")[0].rstrip("%°")
    try:
        float(first.split("·")[0])
    except ValueError:
        return cell in ("", "–")
    return True
