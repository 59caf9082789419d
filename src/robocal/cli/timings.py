"""Where the time of a command goes, for `--timings`: seconds of the clock by what was done, imports apart wherever they happen."""

from __future__ import annotations

import builtins
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

__all__ = ["Timings", "timed"]

# What the events of long work belong to; every other event goes on with what is under way.
PARTS = {
    "read": ("read",),
    "check": ("check", "finding", "gross"),
    "fit": ("start", "noise", "iterate"),
    "prove": ("folds", "leave-one-out", "judge", "round", "bootstrap", "compare", "groups", "layer"),
    "write": ("report", "write"),
}
_PART_OF = {stage: part for part, stages in PARTS.items() for stage in stages}
_FITTED = ("fit", "prove", "check")  # these three iterate too, each for itself


class Timings:
    """Seconds by part: import, read, check, fit, prove, write. What comes before the first event is reading."""

    current: Timings | None = None  # of the command that runs, where somebody asked

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(("import", *PARTS), 0.0)
        self._part, self._since = "read", time.perf_counter()

    def take(self, stage: str) -> None:
        """An event of long work."""
        if not (stage == "iterate" and self._part in _FITTED):
            self._turn(_PART_OF.get(stage, self._part))

    def _turn(self, part: str) -> str:
        """Ends a part and begins another; gives the one that ended."""
        now, before = time.perf_counter(), self._part
        self.seconds[before] += now - self._since
        self._part, self._since = part, now
        return before

    def document(self) -> dict[str, float]:
        """Seconds so far, by part, and all of them."""
        self._turn(self._part)
        told = {part: round(seconds, 4) for part, seconds in self.seconds.items()}
        return {**told, "all": round(sum(self.seconds.values()), 4)}

    def __str__(self) -> str:
        """One line: import 0.412 s, read 0.020 s, ..., all 0.801 s."""
        return ", ".join(f"{part} {seconds:.3f} s" for part, seconds in self.document().items())


@contextmanager
def timed(wanted: bool) -> Iterator[Timings | None]:
    """Measures what is done within, where it is wanted."""
    if not wanted:
        yield None
        return
    timings, plain, here = Timings(), builtins.__import__, threading.get_ident()

    def bring(name: str, *rest: Any, **words: Any) -> Any:
        if timings._part == "import" or name in sys.modules or threading.get_ident() != here:
            return plain(name, *rest, **words)
        before = timings._turn("import")
        try:
            return plain(name, *rest, **words)
        finally:
            timings._turn(before)

    Timings.current = timings
    builtins.__import__ = bring
    try:
        yield timings
    finally:
        builtins.__import__ = plain
        Timings.current = None
