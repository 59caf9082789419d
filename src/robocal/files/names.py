"""What may not stand in a name, wherever names come from: they are written into terminals, CSV, YAML for ROS, URDF and HTML,
and come back from there.

Control characters move the cursor of a terminal or change its colours, line breaks end a line of YAML, embeddings of the
other writing direction show a name as another one. Raw ones are refused when a text file is read (`text.decode`), those
that YAML, JSON and XML spell as escapes when these are understood.

A spreadsheet runs a cell that begins with = + - or @ as a formula. CSV are written so that it takes them for text, and are
read so that a name comes back as it went.
"""

from __future__ import annotations

import re
from typing import Any

from robocal.errors import CONTROL

__all__ = ["FORBIDDEN", "forbidden_character", "forbidden_part", "harmless", "meant"]

FORBIDDEN = "a control character or line break inside a name or text"
FREE_TEXT = ("source", "provenance")  # keys whose texts may have several lines
_BUT_LINES = re.compile(CONTROL.pattern.replace(r"\x00-\x1f", r"\x00-\x08\x0b\x0c\x0e-\x1f"))
_SUSPECT = frozenset("'=+@-")  # what a cell begins with that is worth a look
_FORMULA = re.compile("'*[=+@-]")
_MEANT = re.compile("'+[=+@-]")


def forbidden_character(text: str, *, lines: bool = False) -> re.Match[str] | None:
    """The first character that no name may have; with `lines`, line breaks and tabs may stand."""
    return (_BUT_LINES if lines else CONTROL).search(text)


def forbidden_part(data: Any) -> tuple[str, str] | None:
    """Of plain mappings, lists and texts, the key and the text in which such a character stands."""
    stack: list[tuple[str, Any, bool]] = [("", data, False)]
    while stack:
        at, value, lines = stack.pop()
        if isinstance(value, dict):
            for key, part in value.items():
                if forbidden_character(key):
                    return at, key
                stack.append((f"{at}.{key}" if at else key, part, lines or key in FREE_TEXT))
        elif isinstance(value, list):
            stack += [(f"{at}[{i}]", part, lines) for i, part in enumerate(value) if not isinstance(part, int | float)]
        elif isinstance(value, str) and forbidden_character(value, lines=lines):
            return at, value
    return None


def harmless(cell: object) -> object:
    """A cell as a spreadsheet takes it for what it is: before a text that it would run stands an apostrophe."""
    if not isinstance(cell, str) or cell[:1] not in _SUSPECT or not _FORMULA.match(cell) or _is_number(cell):
        return cell
    return f"'{cell}"


def meant(cell: str) -> str:
    """The name that `harmless` was given."""
    return cell[1:] if _MEANT.match(cell) else cell


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
