"""How texts are encoded: UTF-8, or as an XML file says of itself, on the way in and on the way back."""

from __future__ import annotations

import codecs
import re

__all__ = ["encode", "encoding_of"]

_DECLARED = re.compile(rb"\s*(?:<!--.*?-->\s*)*<\?xml\s[^>]*?encoding\s*=\s*[\"']([A-Za-z0-9._-]+)[\"']", re.DOTALL)
HEAD = 1 << 16  # bytes in which a declaration is looked for
# One byte a letter, by Python's names. What else an XML file may declare is asked to be saved as UTF-8.
LETTERS = ("ascii", "cp1252", "iso8859-1", "iso8859-15")


def encoding_of(data: bytes) -> str:
    """The encoding of a text file by its XML declaration, where it has one of one byte a letter; else UTF-8."""
    declared = _DECLARED.match(data[:HEAD])
    try:
        name = codecs.lookup(declared[1].decode()).name if declared else ""
    except LookupError:
        name = ""
    return name if name in LETTERS else "utf-8"


def encode(text: str) -> bytes:
    """The bytes of a text in the encoding that it says of itself; a letter that this lacks becomes a reference (&#233;)."""
    data = text.encode("utf-8")
    name = encoding_of(data)
    return data if name == "utf-8" else text.encode(name, "xmlcharrefreplace")
