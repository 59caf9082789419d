"""Sentences and advice in English: one entry for every code, by topic, and a test that there is."""

from __future__ import annotations

from robocal.remarks.code import Code
from robocal.remarks.english import cable, drift, files, identify, parameters, verbs
from robocal.remarks.words import Words

__all__ = ["TABLE"]

TABLE: dict[Code, Words] = {
    **identify.TABLE,
    **parameters.TABLE,
    **files.TABLE,
    **verbs.TABLE,
    **drift.TABLE,
    **cable.TABLE,
}
