"""The pages on cable robots say in words what something is before they write it in symbols."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
PAGES = sorted([*DOCS.glob("cable*.md"), *(DOCS / "cables").glob("*.md")])
SYMBOL = re.compile(r"\b[A-Za-z]{1,6}_[a-z0-9]\b|\^|\blambda\b|\bmu\b|[^=<>]=[^=>]|\|[a-z] [-+] [a-z]\|")


def blocks(text):
    """Paragraphs, formulas and headings of a page in order, without code."""
    text = re.sub(r"```.*?```", "CODE", text, flags=re.S)
    for block in re.split(r"\n\s*\n", text.strip("\n")):
        kind = "heading" if block.startswith("#") else "formula" if block.startswith("    ") else "words"
        yield kind, block


@pytest.mark.parametrize("page", PAGES, ids=[p.stem for p in PAGES])
def test_words_come_first(page):
    told = list(blocks(page.read_text(encoding="utf-8")))
    before = "heading"
    for kind, block in told:
        assert not (kind == "formula" and before == "heading"), block
        before = kind
    first = next(block for kind, block in told if kind == "words" and block != "CODE")
    assert not SYMBOL.search(re.sub(r"`[^`]*`|\]\([^)]*\)", "", first)), first
    for kind, block in told:
        if kind == "words" and not block.startswith(("|", "-", "CODE")):
            opening = re.split(r"(?<=[.:;])\s", re.sub(r"\]\([^)]*\)", "", block))[0]
            assert not re.match(r"\W*(?:[A-Za-z]_\w+|[A-Za-z]\b|`[A-Z]\b[^`]*`)\s*(?:=|,)", opening), opening


def test_the_pages_are_there():
    assert len(PAGES) >= 9 and SYMBOL.search("X_0 is") and SYMBOL.search("at lambda") and not SYMBOL.search("the start")
