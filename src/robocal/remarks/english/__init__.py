"""Sentences and advice in English by topic, each under the name of its code. A check may declare its code and its sentence beside
itself."""

from __future__ import annotations

from robocal.remarks.english.cable_remarks import CableRemarks
from robocal.remarks.english.drift_remarks import DriftRemarks
from robocal.remarks.english.drive_remarks import DriveRemarks
from robocal.remarks.english.files import FileRemarks
from robocal.remarks.english.identify_remarks import IdentificationRemarks
from robocal.remarks.english.map_remarks import MapRemarks
from robocal.remarks.english.parameter_remarks import ParameterRemarks
from robocal.remarks.english.rig_remarks import RigRemarks
from robocal.remarks.english.verbs import UseRemarks
from robocal.remarks.english.verdict_remarks import VerdictRemarks
from robocal.remarks.english.vision_remarks import VisionRemarks
from robocal.remarks.phrase import Phrase

__all__ = ["DECLARED", "TABLE", "Code", "declare", "phrase_of"]


class Code(
    VerdictRemarks,
    IdentificationRemarks,
    ParameterRemarks,
    FileRemarks,
    UseRemarks,
    DriftRemarks,
    CableRemarks,
    VisionRemarks,
    MapRemarks,
    DriveRemarks,
    RigRemarks,
):
    """Everything that robocal may remark on, by name."""


TABLE = {p.code: p for topic in Code.__bases__ for p in vars(topic).values() if isinstance(p, Phrase)}
DECLARED: dict[str, Phrase] = {}  # by modules of checks


def declare(code: str, sentence: str, advice: str = "") -> str:
    """Gives a code of its own to the module of a check: its sentence and its advice. Raises ValueError for a code that is taken."""
    phrase = Phrase(sentence, advice)
    if code in TABLE or DECLARED.setdefault(code, phrase) != phrase:
        raise ValueError(f"the code {code} has a sentence already")
    return code


def phrase_of(code: str) -> Phrase:
    """Sentence and advice of a code."""
    return DECLARED[code] if code in DECLARED else TABLE[code]
