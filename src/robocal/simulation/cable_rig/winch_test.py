"""One winch after another at power-up: its brake is released for a moment without torque, while all others stay braked.

A taut cable pulls its drum round and the encoder counts that cable runs out. Where it counts that cable is wound in, the drive turns
the other way; where nothing turns, the cable is slack. Of a cable under t the drum has gone d after the root
of 2 d J / ((t r - f) r), with r the radius at the motor and f its friction. That is how long a brake is released, for the t below which a
cable counts as slack.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.errors import require
from robocal.simulation.platform.rig_run import Wiring
from robocal.simulation.platform.winch_plant import Driven, WinchPlant

__all__ = ["WinchFinding", "examine_winches"]

BRAKED = 1e9  # kg m2: a brake
STEP = 1e-3  # grid: s
NEAR = 1e-3  # m: so far a drum is let go; a cable of 3 m under 25 N is stretched by twice as much


@record
class WinchFinding:
    """A winch, by number, and what is wrong with it."""

    winch: int
    what: Literal["slack", "reversed"]


def examine_winches(
    plant: WinchPlant, wiring: Wiring, start: Driven, least: float
) -> tuple[WinchFinding | None, Array]:
    """The first winch that turns the other way, else the one that turned least of those with less than `least` N on their cable; None
    where all are well. Also the tensions (m,) in N at every drive, by how much torque keeps its drum still. Each winch is put back before
    the next."""
    m = len(plant.first)
    size = np.broadcast_to(np.asarray(plant.winches.radius, float) / np.asarray(plant.winches.gear, float), m)
    inertia = np.broadcast_to(np.asarray(plant.winches.inertia, float), m)
    friction = np.broadcast_to(np.asarray(plant.winches.coulomb, float), m)
    scale, winch = (wiring.array(m)[:, i] for i in (0, 3))
    order = winch.astype(int)
    went, held = np.zeros(m), start.motion.tension[order]
    for channel, which in enumerate(order.tolist()):
        torque = least * size[which] - friction[which]
        require(torque > 0, "friction holds a cable that counts as slack", key="coulomb", found=float(friction[which]))
        steps = math.ceil(math.sqrt(2 * NEAR * inertia[which] / (torque * size[which])) / STEP)
        after, loose = start, _with_brakes(plant, which)
        for _ in range(steps):
            after = loose.run(after, np.zeros(m), STEP, STEP)
            went[channel] = scale[channel] * (after.motors - start.motors)[which, 0] * size[which]
            if abs(went[channel]) >= NEAR * abs(scale[channel]):
                break
        if went[channel] <= -NEAR * abs(scale[channel]):
            return WinchFinding(channel, "reversed"), held
    share = went / np.abs(scale)
    return (WinchFinding(int(np.argmin(share)), "slack") if share.min() < NEAR else None), held


def _with_brakes(plant: WinchPlant, loose: int) -> WinchPlant:
    """The same with brakes on all winches but one."""
    inertia = np.full(len(plant.first), BRAKED)
    inertia[loose] = np.broadcast_to(np.asarray(plant.winches.inertia, float), inertia.shape)[loose]
    return replace(plant, winches=replace(plant.winches, inertia=inertia))
