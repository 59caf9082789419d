"""A page: sections in one file that needs nothing from outside.

Its content security policy allows its own scripts, each by the hash of its text, and no connection at all; without them every
picture is there, and stands still.
"""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from html import escape
from importlib.resources import files
from typing import Any

from robocal._version import __version__
from robocal.report.html import html
from robocal.report.sections import Section, Text

__all__ = ["embed", "page", "pictures", "standalone"]

# What no page may hold: control characters but line feeds and tabs.
UNSEEN = re.compile("[\x00-\x08\x0b-\x1f]")
IDENTIFIER = re.compile(r'((?:\bid|\baria-labelledby)=")([^"]*)"')
PICTURE = re.compile(r'<svg\b[^>]*class="picture\b.*?</svg>', re.DOTALL)
SPECIALIST = "For the specialist: every number, and how it was found"
# Scripts, each of these files, with what a page holds that needs it: something folded, pictures that can be turned.
STYLES = {"cable/cable.css": 'class="picture cable', "map.css": 'class="picture cable map'}
SCRIPTS = {
    ("page.js",): "<details",
    ("scene.js", "viewer.js"): 'id="arrow-data"',
    ("scene.js", "cable/turn.js"): 'data-eye="',
}


def page(
    title: str,
    sections: Iterable[Section],
    *,
    kind: str,
    facts: Sequence[tuple[str, str]] = (),
    made: str = __version__,
    recipe: Mapping[str, Any] | None = None,
) -> str:
    """The text of a page with a title, the kind of document above it, and facts below it; `made` is robocal's version, `recipe` the
    provenance of its document: the command, and the files that were read. The same input gives the same text."""
    told = tuple(sections)
    folded, shown = [s for s in told[1:] if s.folded], [s for s in told[1:] if not s.folded]
    first, body = html((_drop_title(s, title) for s in told[:1]), "head"), html(shown)
    body = f"{_ways(shown, body)}{body}"
    if more := html(folded, "more"):
        body += f'\n<details id="specialist">\n<summary>{SPECIALIST}</summary>\n{_ways(folded, more)}{more}\n</details>'
    scripts = ["".join(map(_asset, names)) for names, sign in SCRIPTS.items() if sign in first + body]
    hashes = " ".join(f"'sha256-{base64.b64encode(hashlib.sha256(t.encode()).digest()).decode()}'" for t in scripts)
    policy = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"
    policy += f"; script-src {hashes}" if hashes else ""
    pairs = "".join(f"<div><dt>{escape(name)}</dt> <dd>{escape(value)}</dd></div>" for name, value in facts if value)
    head = f'<dl class="facts">{pairs}</dl>' if pairs else ""
    ends = "".join(f"<script>{text}</script>\n" for text in scripts)
    name = escape(title)
    text = (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n<meta name="color-scheme" content="light dark">\n'
        f'<meta name="robots" content="noindex">\n<link rel="icon" href="data:,">\n<title>{escape(kind)}: {name}</title>\n'
        f"<style>\n{_style(first + body)}{_asset('print.css')}</style>\n</head>\n<body>\n<main>\n"
        f'<header>\n<p class="eyebrow">{escape(kind)}</p>\n<h1>{name}</h1>\n{head}</header>\n{first}\n{body}\n'
        f"<footer>{_recipe(recipe or {})}Made by robocal{f' {escape(made)}' if made else ''}. This page is complete in itself and "
        f"contacts nothing.</footer>\n</main>\n{ends}</body>\n</html>\n"
    )
    # Control characters and halves of surrogate pairs can be in no file.
    return UNSEEN.sub("\ufffd", text).encode("utf-8", "replace").decode("utf-8")


def _recipe(made: Mapping[str, Any]) -> str:
    """What makes the document again: the command, and what it read."""
    lines = [made["command"]] if made.get("command") else []
    lines += [f"{i['file']}: SHA-256 {i['sha256']}" for i in made.get("inputs", ())]
    return "".join(f"<p>{escape(line)}</p>\n" for line in lines)


def _drop_title(section: Section, title: str) -> Section:
    """The first section of a page without the title, which stands above it."""
    match section.blocks:
        case (Text(parts=((word, "strong"), str(rest))) as line, *others) if title == word or title.startswith(
            f"{word}: "
        ):
            return replace(section, blocks=(replace(line, parts=(rest.strip(),)), *others))
    return section


def embed(sections: Iterable[Section], key: str) -> str:
    """Sections for a page that is not ours, such as a notebook: their style is nested, so it concerns nothing else, and `key`
    begins all identifiers, so that several results, or one twice, stand on one page."""
    shown = html(sections)
    style = _style(shown).replace(":root", "&")
    body = IDENTIFIER.sub(lambda m: m[1] + " ".join(f"{key}-{name}" for name in m[2].split()) + '"', shown)
    own = "background: var(--paper); color: var(--ink); padding: 0.5rem 1rem; line-height: 1.5;"
    return f'<div class="robocal"><style>.robocal {{ {own}\n{style}}}</style>\n{body}</div>'


def pictures(figure: str) -> list[str]:
    """The pictures of a figure one by one, without what turns them on a page."""
    return PICTURE.findall(figure)


def standalone(picture: str) -> str:
    """A picture of a page as a file of its own: with the style that the page gives it."""
    head = picture.index(">") + 1
    style = _style(picture).replace(":root", "svg")
    return f"{picture[:head]}<style>{escape(style, quote=False)}</style>{picture[head:]}\n"


def _ways(sections: Sequence[Section], body: str) -> str:
    """Links to the sections that have a name, and something to say."""
    named = [(s.key, s.title or s.heading) for s in sections if s.key and f'<section id="{s.key}"' in body]
    links = "".join(f'<li><a href="#{key}">{escape(title)}</a></li>' for key, title in named)
    return f'<ul class="jump screen">{links}</ul>\n' if links else ""


def _style(body: str) -> str:
    """The style of what a body holds."""
    names = [name for name, sign in STYLES.items() if sign in body]
    return "".join(map(_asset, ("style.css", *names)))


def _asset(name: str) -> str:
    return files("robocal.report").joinpath(name).read_text(encoding="utf-8")
