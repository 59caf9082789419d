"""Friction of motors that their efforts cannot tell: a joint that moves in one direction, a joint or winch of which no speed is known, a
joint that moves so fast that its effort moves masses.

    effort = gravity + c sgn(v) + b v        with one sign of v alone c looks like gravity of a joint; with none it stays in the efforts

Of a winch one direction is enough: the platform's weight tells its tension.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.diagnose.check_registry import Context, Finding, When, check, doubt
from robocal.diagnose.limits import ARM_SPEED
from robocal.measure.cable.cable_names import cable_names
from robocal.measure.cable.winch_tensions import FRICTION
from robocal.measure.data import Observations
from robocal.measure.machine import Model, joints_of
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["SPEED", "UNSEEN"]

UNSEEN = declare(
    "friction-unseen",
    "friction of {joints} is not told: {why}, so that it stays in what the motors bear, or counts as gravity",
    "Measure in both directions, and state all speeds (speed: in the data file).",
)
SPEED = declare(
    "torque-speed",
    "{joint} moves at up to {speed:.3g}: torques of masses that are moved count as friction there",
    "Check the unit of the speeds; if it is right, measure in slow motion.",
)
WINCHES = "a winch for every cable"
WHY = {0: "no speed is given", 1: "they move in one direction only"}


@check("friction-unseen", When.FIT, order=219, needs=("data", "fit"))
def unseen_friction(context: Context[Model]) -> Iterator[Finding]:
    """The joints whose speeds have fewer than two signs in all files together."""
    seen: dict[str, set[float]] = {}
    for obs in context.need_data.observations:
        if obs.kind == "joint_torque":
            names = [j.name for j in joints_of(context.model)]
            signs, which = np.sign(obs.extra["speed"]), obs.extra["joint"].astype(np.int64)
            for i in np.unique(which).tolist():
                seen.setdefault(names[i], set()).update(signs[which == i].tolist())
        elif obs.kind == "winches" and np.ndim(obs.extra.get("speed", 0.0)) == 2 and _rubs(obs):
            for cable, column in zip(cable_names(obs, WINCHES), obs.extra["speed"].T, strict=True):
                # One direction is as good as two.
                seen.setdefault(cable, set()).update((1.0, -1.0) if column.any() else ())
    for count, why in WHY.items():
        joints = tuple(n for n, signs in seen.items() if len(signs - {0.0}) == count)
        if joints:
            yield doubt(UNSEEN, joints=joints, why=why)


def _rubs(obs: Observations) -> bool:
    free = obs.options.get("free")
    return isinstance(free, tuple) and not set(FRICTION).isdisjoint(map(str, free))


@check("torque-speeds", When.FIT, order=222, needs=("data",))
def torque_speeds(context: Context[Model]) -> Iterator[Finding]:
    """The joint that turns fastest."""
    for obs in context.need_data.observations:
        if obs.kind != "joint_torque" or not len(obs):
            continue
        joints = joints_of(context.model)
        turns = np.array([j.type != "prismatic" for j in joints])[obs.extra["joint"].astype(np.int64)]
        speed = np.where(turns, np.abs(obs.extra["speed"]), 0.0)
        at = int(speed.argmax())
        if speed[at] > ARM_SPEED:
            name = joints[int(obs.extra["joint"][at])].name
            yield doubt(SPEED, joint=name, speed=Quantity(float(speed[at]), "rad/s"))
            return
