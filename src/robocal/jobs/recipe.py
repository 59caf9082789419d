"""The recipe of a run: what was chosen, what was read, when, and how long it took."""

from __future__ import annotations

import datetime
import time
from collections.abc import Mapping, Sequence
from typing import Any

from robocal.calibrate.identification import Identification
from robocal.files.leaving import LeftOut
from robocal.files.parts import RowsLeftOut, made_by
from robocal.files.plain import plain
from robocal.files.result import Provenance
from robocal.files.shown import shown
from robocal.files.text import InputFile
from robocal.measure.machine import Machine

__all__ = ["Timed", "recipe_of"]


class Timed:
    """When a run started, and how long it has taken."""

    def __init__(self) -> None:
        self.started, self._clock = datetime.datetime.now(datetime.UTC), time.perf_counter()

    @property
    def seconds(self) -> float:
        """Since the start."""
        return time.perf_counter() - self._clock


def recipe_of(
    found: Identification[Machine],
    choices: Mapping[str, Any],
    command: str,
    inputs: Sequence[InputFile],
    timed: Timed,
    left_out: Sequence[LeftOut],
) -> Provenance:
    """What made the result of a run; what was left to us is recorded as it was decided."""
    decided = {
        "hold_out": found.options.hold_out,
        "leave_one_out": any(s.leave_one_out is not None for s in found.stages),
    }
    return shown(
        Provenance,
        made_by(command, inputs),
        seed=choices["seed"],
        started=timed.started.isoformat(timespec="seconds"),
        seconds=round(timed.seconds, 3),
        options=plain({**choices, **decided}),
        left_out=[shown(RowsLeftOut, o) for o in left_out],
    )
