"""The recipe of a run: what was chosen, what was read, when, and how long it took."""

from __future__ import annotations

import datetime
import time
from collections.abc import Mapping, Sequence
from typing import Any

from robocal.calibrate.identification import Identification
from robocal.files.leaving import LeftOut
from robocal.files.result import Provenance
from robocal.files.text import InputFile
from robocal.jobs.outcome import provenance
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
    stamp = timed.started.isoformat(timespec="seconds")
    return provenance(command, inputs, choices["seed"], stamp, timed.seconds, {**choices, **decided}, left_out)
