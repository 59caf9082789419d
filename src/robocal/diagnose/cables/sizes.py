"""Positions that span far more or less than the lengths say: one of them is in another unit."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.cables.geometry import CableRobot
from robocal.diagnose.check_registry import Context, Finding, Given, When, check, refuse
from robocal.diagnose.limits import SIZE_CONFIGURATIONS, SIZES_APART
from robocal.measure.lengths import locate_platform
from robocal.remarks.english import declare

__all__ = ["TWO_SIZES", "sizes"]

TWO_SIZES = declare(
    "two-sizes",
    "positions and lengths disagree on the size of the robot",
    "Check the unit of positions and of lengths.",
)


@check("sizes", When.READ, order=20, given=Given.ACCEPTED, needs=("data",))
def sizes(context: Context[CableRobot]) -> Iterator[Finding]:
    """The scatter of measured positions beside that of the lengths; the one that is farther from the size of the robot is likelier to be
    wrong."""
    robot, data = context.model, context.need_data
    read = [o for o in data.observations if o.kind == "lengths"]
    every = np.ones(len(data.configurations), dtype=bool)
    places = [locate_platform(robot, o, every)[:, :3, 3] for o in read]
    for obs in data.observations:
        if not places or obs.kind not in ("position", "pose"):
            continue
        lengths, by_lengths = read[0], places[0][obs.configuration]
        known = np.isfinite(by_lengths).all(axis=1)
        if known.sum() >= SIZE_CONFIGURATIONS:
            here, there = (float(np.linalg.norm(v[known].std(axis=0))) for v in (obs.value[:, :3], by_lengths))
        else:  # lengths that no pose meets: of a step in any direction a length takes a third, in the mean of squares
            of = lengths.extra["cable"]
            each = [float(lengths.value[of == c, 0].std()) for c in np.unique(of)]
            here, there = float(np.linalg.norm(obs.value[:, :3].std(axis=0))), float(np.sqrt(3.0) * np.median(each))
        if len(obs) >= SIZE_CONFIGURATIONS and there > 0 and not 1 / SIZES_APART < here / there < SIZES_APART:
            frame = float(np.linalg.norm(robot.a.std(axis=0)))
            positions = abs(np.log(here / frame)) > abs(np.log(there / frame))
            source, wrong = (obs.source, "position") if positions else (lengths.source, "lengths")
            yield refuse(TWO_SIZES, source=source, wrong=wrong, positions=here, lengths=there, frame=frame)
            return
