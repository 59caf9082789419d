"""A camera on an arm whose geometry is off: frames and arm together, where residuals show that its making is part of them.

    x, g = argmin |W (r + J dx + J_g g)|^2 + |g / (k s)|^2

s are the errors that making leaves of the arm's parameters g, and k by how much they are larger here, as the residuals of the frames alone
tell it (`prove/frames_alone`). Where k is known, this is the best linear prediction of both. Frames alone take the arm's errors for noise.
Source: Robinson, That BLUP is a good thing, Statistical Science 6 (1991).
"""

from __future__ import annotations

from robocal._record import record
from robocal._types import Array
from robocal.fit.options import Options
from robocal.measure.data import DataSet
from robocal.measure.machine import Mechanism
from robocal.progress import Watch
from robocal.prove.decision import Decision, decide

__all__ = ["JointedArm", "free_arm"]


@record(eq=False)
class JointedArm:
    """The machine, and its joint values (m, n) at the views, rad or m."""

    machine: Mechanism
    joints: Array


def free_arm(
    arm: Mechanism, data: DataSet, options: Options, watch: Watch | None = None
) -> tuple[Decision[Mechanism], Decision[Mechanism]]:
    """The decision on the frames alone, and the one with the arm under the prior that they show: the same one where they show none. Raises
    ModelError."""
    alone = decide(arm.with_table(arm.table.with_free(())), data, options, watch)
    if not alone.frames_alone or alone.share.covariance is None:
        return alone, alone
    found = alone.model.table
    prior = {n: alone.share.making * found[n].usual for n in arm.geometric if n in found}
    freed = found.with_free(tuple(prior)).with_priors(prior)
    return alone, decide(alone.model.with_table(freed), alone.need_data, options, watch)
