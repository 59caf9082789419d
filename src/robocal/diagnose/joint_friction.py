"""Friction of joints that torques cannot tell: a joint that moves in one direction, or of which no speed is given.

tau = gravity + c sgn(q') + b q'        with one sign of q' alone c looks like gravity; with none it stays in the torques
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.diagnose.check_registry import Context, Finding, When, check, doubt
from robocal.measure.machine import Model, joints_of
from robocal.remarks.english import declare

__all__ = ["UNSEEN"]

UNSEEN = declare(
    "friction-unseen",
    "friction of {joints} is not told: {why}, so that friction stays in their torques, or counts as gravity",
    "Measure in both directions, and state the speed of every joint (speed: in the data file).",
)
WHY = {0: "no speed is given", 1: "they move in one direction only"}


@check("friction-unseen", When.FIT, order=219, needs=("data", "fit"))
def unseen_friction(context: Context[Model]) -> Iterator[Finding]:
    """The joints whose speeds have fewer than two signs in all files together."""
    read = [o for o in context.need_data.observations if o.kind == "joint_torque" and len(o)]
    if not read:
        return
    joint = np.concatenate([o.extra["joint"] for o in read]).astype(np.int64)
    sign = np.sign(np.concatenate([o.extra["speed"] for o in read]))
    seen = {j: len(set(sign[joint == j].tolist()) - {0.0}) for j in sorted(set(joint.tolist()))}
    for count, why in WHY.items():
        names = tuple(joints_of(context.model)[j].name for j, n in seen.items() if n == count)
        if names:
            yield doubt(UNSEEN, joints=names, why=why)
