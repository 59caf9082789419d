"""A target, an instrument or a sensor's zero that stood elsewhere for a part of a file: no number of such data may be used."""

from __future__ import annotations

from collections.abc import Iterator

from robocal.diagnose.check_registry import Context, Finding, Level, When, check, of_remarks, once
from robocal.diagnose.segments.find import Segment, find_segments, segment_remarks
from robocal.measure.machine import Model

__all__ = ["findings_of_segments", "segments"]


@once
def segments(context: Context[Model]) -> tuple[Segment, ...]:
    """What stood elsewhere, at the values of the fit, else of the baseline."""
    return find_segments(context.model, context.need_data, context.values)


@check("moved", When.PROOF, order=180, needs=("data",))
def findings_of_segments(context: Context[Model]) -> Iterator[Finding]:
    """One finding for every segment."""
    yield from of_remarks(segment_remarks(segments(context)), Level.REFUSE)
