"""Torques of joints that no arm of this reach bears, as newton millimetres that are called newton metres make them.

    density = max_j |tau_j| / (g s^4)        s how far the tool gets, |tau_j| what the tenth of the largest torques of a joint exceeds

so many kilograms at the end of the reach, for each cubic metre of it. Gravity and friction of all arms lie between the limits.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.diagnose.check_registry import Context, Finding, Given, Machines, When, check, refuse
from robocal.diagnose.limits import ARM_DENSITY, ARM_LONGEST, ARM_SHORTEST, TORQUE_ROWS
from robocal.geometry.gravity import GRAVITY
from robocal.measure.machine import Mechanism, joints_of
from robocal.measure.reach import size_of
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["TORQUE_SIZE", "torque_sizes"]

TORQUE_SIZE = declare(
    "torque-size",
    "the torques of {joint} reach {torque:.3g}, as {mass:.3g} at {reach:.3g} make them: no arm of this reach is so {word}",
    "State their unit, and give those behind the gears.",
)


@check("torque-sizes", When.READ, order=15, machines=Machines.JOINTED, given=Given.ACCEPTED, needs=("data",))
def torque_sizes(context: Context[Mechanism]) -> Iterator[Finding]:
    """The joint that turns with the largest torques of each file."""
    for obs in context.need_data.observations:
        if obs.kind != "joint_torque" or not len(obs):
            continue
        reach, g = size_of(context.model), float(np.linalg.norm(GRAVITY))
        joint, torque = obs.extra["joint"].astype(np.int64), np.abs(obs.value[:, 0])
        turning = [i for i, j in enumerate(joints_of(context.model)) if j.type != "prismatic"]
        large = {i: float(np.quantile(torque[joint == i], TORQUE_ROWS)) for i in turning if (joint == i).any()}
        # Of lengths that no arm has, others tell; torques that are all zero say nothing of their unit.
        if not large or not ARM_SHORTEST <= reach <= ARM_LONGEST or max(large.values()) <= 0:
            continue
        worst = max(large, key=lambda i: large[i])
        mass = large[worst] / (g * reach)
        least, most = ARM_DENSITY["light"], ARM_DENSITY["heavy"]
        if not least <= mass / reach**3 <= most:
            yield refuse(
                TORQUE_SIZE, joint=joints_of(context.model)[worst].name, torque=Quantity(large[worst], "N m"), mass=Quantity(mass, "kg"),
                reach=Quantity(reach), word="light" if mass / reach**3 < least else "heavy", source=obs.source,
            )  # fmt: skip
            return
