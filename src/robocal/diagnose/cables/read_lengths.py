"""Lengths that were read: configurations that repeat others in every number, positions that span far more or less than lengths say
(one of them is in another unit), and what stretch does to them.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.cables.geometry import CableRobot, straight
from robocal.diagnose.check_registry import Context, Finding, Given, When, check, note, refuse
from robocal.diagnose.limits import COPIES, SIZE_CONFIGURATIONS, SIZES_APART
from robocal.measure.data import Observations
from robocal.measure.lengths import gains_at, locate_platform, owner, readings
from robocal.measure.machine import Model
from robocal.remarks.code import Code
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["COPIED", "TWO_SIZES", "copies", "sizes", "stretch"]

TWO_SIZES = declare(
    "two-sizes",
    "positions and lengths disagree on the size of the robot",
    "Check the unit of positions and of lengths, and the gain of the drums.",
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
            wound = readings(robot, lengths, len(data.configurations))
            each = [float(np.nanstd(w)) for w in wound.T[np.isfinite(wound).any(axis=0)]]
            here, there = float(np.linalg.norm(obs.value[:, :3].std(axis=0))), float(np.sqrt(3.0) * np.median(each))
        if len(obs) >= SIZE_CONFIGURATIONS and there > 0 and not 1 / SIZES_APART < here / there < SIZES_APART:
            frame = float(np.linalg.norm(robot.frame_points.std(axis=0)))
            positions = abs(np.log(here / frame)) > abs(np.log(there / frame))
            source, wrong = (obs.source, "position") if positions else (lengths.source, "lengths")
            yield refuse(TWO_SIZES, source=source, wrong=wrong, positions=here, lengths=there, frame=frame)
            return


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
    if COPIES * len(parts) < len(again) and len(set(seen.values())) > 1:
        c, first = again[0]
        ids, source = data.configurations.ids, data.observations[0].source
        yield refuse(COPIED, source=source, count=len(again), of=len(parts), one=str(ids[c]), other=str(ids[first]))


COMPUTED = "computed"  # tensions that hold the platform's weight, instead of readings


@check("stretch", When.DATA, order=10, needs=("data",))
def stretch(context: Context[CableRobot]) -> Iterator[Finding]:
    """Of every instrument that read lengths, with the tensions that are to be used."""
    for obs in context.need_data.observations:
        if obs.kind == "lengths":
            yield from _of_lengths(context.model, obs)


def _of_lengths(robot: CableRobot, obs: Observations) -> Iterator[Finding]:
    if robot.elasticity is None:
        if "tension" in obs.extra and robot.density is None:
            yield note(Code.TENSIONS_ASIDE, robot=robot.name)
        return
    cable = obs.extra["cable"].astype(np.int64)
    full = gains_at(robot, obs)[cable] * obs.value[:, 0] + robot.zeros[cable]
    if owner(obs):  # what they count from is not known yet
        full = straight(robot, robot.home)[0][0][cable]
    if "tension" in obs.extra:
        most = float(np.max(robot.elasticity[cable] * obs.extra["tension"] * full, initial=0.0))
        how = "computed" if obs.options.get("tension") == COMPUTED else "measured"
        yield note(Code.STRETCH_TAKEN, most=Quantity(most), how=how)
    elif robot.limits is not None:
        most = float(np.max(robot.elasticity[cable] * np.ptp(robot.limits, axis=1)[cable] * full, initial=0.0))
        yield note(Code.STRETCH_LEFT, most=Quantity(most))
