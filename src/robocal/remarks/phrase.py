"""What a language says of a code."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["Phrase"]


class Phrase(NamedTuple):
    """A sentence without its full stop, and what to do about it ("" where nothing is to be done)."""

    sentence: str
    advice: str = ""
