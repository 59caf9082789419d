"""What a check finds: a code with its numbers, and what it means for the verdict.

refuse     data or model are wrong: no number of the fit may be used
qualify    a gain is not proven, or only near what was measured
doubt      something that the user should look at; the verdict stands
note       a fact that the user should know
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum

from robocal.remarks.remark import Number, Remark

__all__ = ["Finding", "Level", "doubt", "note", "of_remarks", "qualify", "refuse"]


class Level(StrEnum):
    """What a finding means for the verdict."""

    REFUSE = "refuse"
    QUALIFY = "qualify"
    DOUBT = "doubt"
    NOTE = "note"


@dataclass(frozen=True)
class Finding:
    """One result of a check: `code` and `items` as a remark has them, its level, and the name of the check."""

    code: str
    items: tuple[tuple[str, Number], ...]
    level: Level
    check: str = ""

    @property
    def numbers(self) -> Mapping[str, Number]:
        """The numbers by name."""
        return dict(self.items)

    @property
    def remark(self) -> Remark:
        """The same for people."""
        return Remark(self.code, self.items)


def refuse(code: str, **numbers: Number) -> Finding:
    """A finding after which no number may be used."""
    return Finding(code, tuple(numbers.items()), Level.REFUSE)


def qualify(code: str, **numbers: Number) -> Finding:
    """A finding that takes from a gain."""
    return Finding(code, tuple(numbers.items()), Level.QUALIFY)


def doubt(code: str, **numbers: Number) -> Finding:
    """A finding that the user should look at."""
    return Finding(code, tuple(numbers.items()), Level.DOUBT)


def note(code: str, **numbers: Number) -> Finding:
    """A finding that the user should know."""
    return Finding(code, tuple(numbers.items()), Level.NOTE)


def of_remarks(remarks: Iterable[Remark], level: Level) -> list[Finding]:
    """Findings of one level from remarks that were written elsewhere."""
    return [Finding(r.code, r.items, level) for r in remarks]
