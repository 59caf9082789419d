"""One winch after another at power-up: its brake is released for a moment without torque, while all others stay braked.

A taut cable pulls its drum round and the encoder counts that cable runs out. Where it counts that cable is wound in, the drive turns the
other way; where nothing turns, the cable is slack. Of a cable under t the drum has gone d after the root of 2 d J / (t r^2), r being the
radius at the motor: that is how long a brake is released, for the t below which a cable counts as slack.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.simulation.cable_rig.standstill import Wiring
from robocal.simulation.platform.winch_plant import Driven, WinchPlant

__all__ = ["WinchFinding", "examine_winches"]

BRAKED = 1e9  # kg m2: a brake
STEP, SETTLE = 1e-3, 1.0  # grid: s
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
    now = _with_brakes(plant, None).run(start, np.zeros(m), SETTLE, STEP)
    went = np.zeros(m)
    for channel in range(m):
        winch = int(np.argmax(np.abs(wiring.torque[:, channel])))
        steps = math.ceil(math.sqrt(2 * NEAR * inertia[winch] / (least * size[winch] ** 2)) / STEP)
        after, loose = now, _with_brakes(plant, winch)
        for _ in range(steps):
            after = loose.run(after, np.zeros(m), STEP, STEP)
            went[channel] = (wiring.counts @ ((after.motors - now.motors)[:, 0] * size))[channel]
            if abs(went[channel]) >= NEAR:
                break
        if went[channel] <= -NEAR:
            return WinchFinding(channel, "reversed"), np.abs(wiring.torque).T @ now.motion.tension
    slack = np.abs(went) < NEAR * np.abs(np.diag(np.abs(wiring.counts) @ np.abs(wiring.torque)))
    found = WinchFinding(int(np.argmin(went)), "slack") if slack.any() else None
    return found, np.abs(wiring.torque).T @ now.motion.tension


def _with_brakes(plant: WinchPlant, loose: int | None) -> WinchPlant:
    """The same with brakes on all winches but one."""
    inertia = np.full(len(plant.first), BRAKED)
    if loose is not None:
        inertia[loose] = np.broadcast_to(np.asarray(plant.winches.inertia, float), inertia.shape)[loose]
    return replace(plant, winches=replace(plant.winches, inertia=inertia))
