"""Configurations of a list that repeat others in every number that was read: rows that were copied."""

from __future__ import annotations

from collections.abc import Iterator

from robocal.diagnose.check_registry import Context, Finding, Given, When, check, refuse
from robocal.diagnose.limits import CABLE_COPIES
from robocal.measure.machine import Model
from robocal.remarks.english import declare

__all__ = ["COPIED", "copies"]

COPIED = declare(
    "configurations-copied", "configurations repeat others to the last digit", "Give every measurement once."
)


@check("copies", When.READ, order=10, given=Given.ACCEPTED, needs=("data",))
def copies(context: Context[Model]) -> Iterator[Finding]:
    """Of one length a coarse encoder may show the same twice, of eight and a pose it does not."""
    data = context.need_data
    parts: dict[int, list[bytes]] = {}
    for obs in data.observations:
        for c, value in zip(obs.configuration.tolist(), obs.value, strict=True):
            parts.setdefault(c, []).append(value.tobytes())
    seen: dict[bytes, int] = {}
    again = [(c, first) for c, part in parts.items() if (first := seen.setdefault(b"".join(part), c)) != c]
    if CABLE_COPIES * len(parts) < len(again) and len(set(seen.values())) > 1:
        c, first = again[0]
        ids, source = data.configurations.ids, data.observations[0].source
        yield refuse(COPIED, source=source, count=len(again), of=len(parts), one=str(ids[c]), other=str(ids[first]))
