"""The page of a cable robot: its sections in one file that needs nothing from outside."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable, Sequence
from html import escape

from robocal.report.cable.paint import asset, clean
from robocal.report.html import html
from robocal.report.page import style
from robocal.report.sections import Block, Figure, Section, Table, Text

__all__ = ["page", "part"]

PRINT = "@media print { .whole { break-inside: avoid; } }\n"


def part(heading: str, text: str = "", figure: str = "", table: Sequence[Sequence[str]] = ()) -> Section:
    """A section of paragraphs (parted by empty lines), a picture of this folder, and a table whose first row is the header (none
    where all its cells are empty)."""
    blocks: list[Block] = [Text.of(p.strip()) for p in text.split("\n\n") if p.strip()]
    if figure:
        blocks.append(Figure(figure))
    if table:
        header, rows = table[0], table[1:]
        right = tuple(j for j in range(len(header)) if rows and all(_number(r[j]) for r in rows))
        blocks.append(Table(tuple(header), tuple(map(tuple, rows)), right))
    return Section(heading, tuple(blocks))


def page(title: str, sections: Iterable[Section]) -> str:
    """The text of report.html. Its content security policy allows one script, by its hash, which turns pictures of space; without
    it they stand still."""
    name, body = escape(title), html(sections)
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


def _number(cell: str) -> bool:
    """Whether a cell is a number, with or without a unit, or stands for a missing one."""
    first = cell.replace("\u2212", "-").replace("\u00a0", " ").split(" ")[0].rstrip("%°")
    try:
        float(first.split("·")[0])
    except ValueError:
        return cell in ("", "–")
    return True
