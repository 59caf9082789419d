"""What is said of frames that have two places, or another than stated; see `frame_steps`."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from robocal.diagnose import limits
from robocal.diagnose.camera_views import explain_views, wrong_views
from robocal.diagnose.check_registry import Context, Finding, Level, check_fit_twice, doubt, of_remarks, once, refuse
from robocal.diagnose.fit_checks import findings_of_segments
from robocal.diagnose.frame_steps import FrameStep, find_frame_steps
from robocal.diagnose.segments.tell import segment_remarks
from robocal.diagnose.slack import find_slack
from robocal.diagnose.stated_numbers import find_stated_number
from robocal.diagnose.time_offset import time_offset
from robocal.diagnose.zero_steps import fitted_beside, segment_of_zero
from robocal.measure.data import DataSet, Observations
from robocal.measure.machine import Model, sensor_zeros
from robocal.remarks.english import declare
from robocal.remarks.remark import Number, Quantity

__all__: list[str] = []

FRAME_MOVED = declare(
    "frame-moved",
    "from {first} on (row {row} of {file}) {what} stands elsewhere than before: by {shift:.3g}[, turned by {turn:.3g}][; {others} would "
    "explain it as well]",
    "Look whether it moved. Give it another name from that row on, or leave those rows out (--exclude {row}-{last}).",
)
FRAME_ELSEWHERE = declare(
    "frame-elsewhere",
    "{what} is not where it is stated: these data put it {shift:.3g} away[, turned by {turn:.3g}][; {others} elsewhere would explain it "
    "as well]",
    "Measure its place again. Or let it be found: `free: true`, with a prior of what it may be off by.",
)


@check_fit_twice(doubt=("frame-step", 217), refuse=("wrong-frame", 181))
@once
def frame_steps(context: Context[Model]) -> list[Finding]:
    """Frames that stand elsewhere from a configuration on. They are refused where the numbers that were fitted are off by it."""
    fit = context.need_fit
    # What is wrong with all views, with a number, with the clock, or a fit that found no end, leaves nothing to ask of single frames.
    asked = [c.run for c in (findings_of_segments, wrong_views) if c.name not in context.silent]
    asked += [find_stated_number, time_offset]
    if not fit.solution.settled() or any(f.level is Level.REFUSE for find in asked for f in find(context)):
        return []
    sigma = dict(zip(fit.total.names, fit.total.sigma.tolist(), strict=True))
    steps = find_frame_steps(context.model, fit.data, fit.problem, fit.solution.x, sigma)
    # A target that seems to stand on its head is counted otherwise, and the others with it.
    if any(s.first is None and s.turn > limits.FRAME_OTHERWISE for s in steps) and (found := explain_views(context)):
        return found
    zeros = sensor_zeros(context.model)
    return [f for s in steps for f in (_of_zero(context, s) if s.frame in zeros else [_finding(context, s)])]


def _of_zero(context: Context[Model], step: FrameStep) -> list[Finding]:
    """A zero that steps, told as `segments` would, and refused as frames are. Cables that hang now and then do not slip."""
    hung = [f"{s.cable}.l0" for s in find_slack(context)]
    if step.first is None or step.frame in hung:
        return []
    found = segment_of_zero(context, step.frame, step.first, step.shift, step.chance)
    large = found is not None and found.strength > limits.SEGMENT_ZERO_SIZE
    # With both places fitted the zero lies between them, and is right at neither.
    mixed = step.chance < limits.SEGMENT_CHANCE and fitted_beside(context, step.frame, step.first) > limits.FRAME_FITTED
    level = Level.REFUSE if mixed or step.bias > limits.FRAME_BIAS else Level.DOUBT
    return of_remarks(segment_remarks([found]), level) if found is not None and large else []


def _finding(context: Context[Model], step: FrameStep) -> Finding:
    data = context.need_data
    numbers: dict[str, Number] = {
        "what": _what(data, step.frame),
        "shift": Quantity(step.shift),
        "turn": Quantity(step.turn, "rad"),
        "others": ", ".join(_what(data, n) for n in step.rivals) or None,
    }
    mixed = step.chance < limits.SEGMENT_CHANCE and _fitted(data, step) > limits.FRAME_FITTED
    level = refuse if mixed or step.bias > limits.FRAME_BIAS else doubt
    if step.first is None:
        return level(FRAME_ELSEWHERE, **numbers)
    seen = next(iter(_seen(data, step.frame)))
    rows = np.flatnonzero(seen.configuration >= step.first)
    known = np.arange(len(seen)) if seen.rows is None else seen.rows
    numbers |= {"first": data.configurations.ids[step.first], "file": seen.source.replace("\\", "/").rpartition("/")[2]}
    return level(FRAME_MOVED, **numbers, row=int(known[rows].min()), last=int(known.max()))


def _fitted(data: DataSet, step: FrameStep) -> float:
    """Which share of the rows of either place was fitted, the smaller of the two: what was set aside bends nothing."""
    late, used = [], []
    for obs in _seen(data, step.frame):
        mine = np.ones(len(obs), dtype=bool)
        if obs.frame is None or obs.frame.name != step.frame:
            mine = np.array(
                [
                    obs.targets[t].name == step.frame
                    for t in (obs.target if obs.target is not None else np.zeros(len(obs), int))
                ]
            )
        late.append((obs.configuration >= (-1 if step.first is None else step.first))[mine])
        used.append((np.ones(len(obs), dtype=bool) if obs.used is None else obs.used)[mine])
    after, fitted = np.concatenate(late), np.concatenate(used)
    return min((float(fitted[some].mean()) for some in (after, ~after) if some.any()), default=0.0)


def _seen(data: DataSet, name: str) -> Iterable[Observations]:
    """The observations in which a frame is looked at, or looks."""
    return (
        o for o in data.observations if name in {t.name for t in o.targets} | ({o.frame.name} if o.frame else set())
    )


def _what(data: DataSet, name: str) -> str:
    """What a frame is called."""
    looks = any(o.frame is not None and o.frame.name == name for o in data.observations)
    return f"the instrument {name}" if looks else f"the target {name}"
