"""Sentences and advice in English: one entry for every code, by topic, and a test that there is. A check may
declare its code and its sentence beside itself."""

from __future__ import annotations

from robocal.remarks.code import Code
from robocal.remarks.english import cable_remarks, drift_remarks, files, identify_remarks, parameter_remarks, verbs
from robocal.remarks.phrase import Phrase

__all__ = ["DECLARED", "TABLE", "declare", "phrase_of"]

TABLE: dict[Code, Phrase] = {
    **identify_remarks.TABLE,
    **parameter_remarks.TABLE,
    **files.TABLE,
    **verbs.TABLE,
    **drift_remarks.TABLE,
    **cable_remarks.TABLE,
}

DECLARED: dict[str, Phrase] = {}  # by modules of checks


def declare(code: str, sentence: str, advice: str = "") -> str:
    """Gives a code of its own to the module of a check: its sentence and its advice. Raises ValueError for a code that is taken."""
    if code in TABLE or DECLARED.get(code, (sentence, advice)) != (sentence, advice):
        raise ValueError(f"the code {code} has a sentence already")
    DECLARED[code] = Phrase(sentence, advice)
    return code


def phrase_of(code: str) -> Phrase:
    """Sentence and advice of a code."""
    return DECLARED[code] if code in DECLARED else TABLE[Code(code)]
