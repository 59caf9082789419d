"""What stretch does to lengths that were read, or would do."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.cables.geometry import CableRobot
from robocal.diagnose.check_registry import Context, Finding, When, check, note
from robocal.measure.data import Observations
from robocal.measure.lengths import owner
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity

__all__ = ["stretch"]

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
    full = obs.value[:, 0] + robot.zeros[cable]
    if owner(obs):  # what they count from is not known yet
        full = np.linalg.norm(robot.home[:3, 3] - robot.a, axis=1)[cable]
    if "tension" in obs.extra:
        most = float(np.max(robot.elasticity[cable] * obs.extra["tension"] * full, initial=0.0))
        how = "computed" if obs.options.get("tension") == COMPUTED else "measured"
        yield note(Code.STRETCH_TAKEN, most=Quantity(most), how=how)
    elif robot.limits is not None:
        most = float(np.max(robot.elasticity[cable] * np.ptp(robot.limits, axis=1)[cable] * full, initial=0.0))
        yield note(Code.STRETCH_LEFT, most=Quantity(most))
