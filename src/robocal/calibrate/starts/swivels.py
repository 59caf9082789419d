"""Where the encoders of swivelling pulleys count from: the mean direction of what they show beyond the nominal robot's angle."""

from __future__ import annotations

from robocal.calibrate.starts.seen import Seen, start
from robocal.measure.swivel import zeros_at

__all__: list[str] = []


@start("swivel")
def _swivel(seen: Seen) -> list[dict[str, float]]:
    return [zeros_at(seen.model, seen.obs, seen.index, seen.machine)]
