"""Where encoders count from: the mean of what they show beyond the nominal robot's angle or length."""

from __future__ import annotations

from robocal.fit.starts.target_rows import TargetRows, start
from robocal.measure import lengths, swivel

__all__: list[str] = []


@start("swivel")
def _swivel(seen: TargetRows) -> list[dict[str, float]]:
    return [swivel.zeros_at(seen.model, seen.obs, seen.index, seen.machine)]


@start("lengths")
def _lengths(seen: TargetRows) -> list[dict[str, float]]:
    return [lengths.zeros_at(seen.model, seen.obs, seen.index, seen.machine)] if lengths.owner(seen.obs) else []
