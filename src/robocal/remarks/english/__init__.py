"""Sentences and advice in English: one entry for every code, by topic, and a test that there is. A check may
declare its code and its sentence beside itself."""

from __future__ import annotations

from robocal.remarks.code import Code
from robocal.remarks.english import cable, drift, files, identify, parameters, verbs
from robocal.remarks.words import Words

__all__ = ["DECLARED", "TABLE", "declare", "words_of"]

TABLE: dict[Code, Words] = {
    **identify.TABLE,
    **parameters.TABLE,
    **files.TABLE,
    **verbs.TABLE,
    **drift.TABLE,
    **cable.TABLE,
}

DECLARED: dict[str, Words] = {}  # by modules of checks


def declare(code: str, sentence: str, advice: str = "") -> str:
    """Gives a code of its own to the module of a check: its sentence and its advice. Raises ValueError for a code that is taken."""
    if code in TABLE or DECLARED.get(code, (sentence, advice)) != (sentence, advice):
        raise ValueError(f"the code {code} has a sentence already")
    DECLARED[code] = Words(sentence, advice)
    return code


def words_of(code: str) -> Words:
    """Sentence and advice of a code."""
    return DECLARED[code] if code in DECLARED else TABLE[Code(code)]
