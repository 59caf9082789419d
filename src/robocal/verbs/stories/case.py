"""What a case of the demo is, and what each of its steps finds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from robocal.jobs.outcome import Outcome
from robocal.jobs.watching import Watch

__all__ = ["Case", "Finding"]


@dataclass(frozen=True)
class Finding:
    """One step of a case: what was done in words, its outcome, facts worth telling, and whether it is as expected."""

    title: str
    outcome: Outcome
    facts: tuple[str, ...]
    expected: str
    ok: bool
    repeat: str = ""


@dataclass(frozen=True)
class Case:
    """A case by name: its title, the story before it starts, where the numbers come from, and the function that does
    it."""

    name: str
    title: str
    story: str
    simulated: bool
    run: Callable[[Path, int, Watch | None], Iterator[Finding]] = field(repr=False)
