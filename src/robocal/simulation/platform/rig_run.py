"""A plant under its controller: the compiled loop of both over many periods.

    run = follow(controller, state, plant, driven, goal, seconds, settle=0.2)
    run.state, run.driven, run.seconds, run.log            # both states go on from here with the next goal

The encoders of the plant have a zero that nobody knows, and count. A `Wiring` says so, and which channel of the controller is on which
winch: rigs that are put together wrongly are other wirings.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from robocal._jit import as_kernel_array
from robocal._record import record
from robocal._types import Array
from robocal.control.platform.platform_controller import PlatformController, PlatformState
from robocal.errors import require
from robocal.simulation.platform._kernels import controlled
from robocal.simulation.platform.platform_plant import each_number
from robocal.simulation.platform.winch_plant import Driven, WinchPlant

__all__ = ["FollowLog", "Followed", "Wiring", "follow"]

HEAD = 28


@record(eq=False)
class Wiring:
    """How m channels of a controller are put to the winches, a number of each or of all: what an encoder shows per turn of its motor, where
    it shows 0 (rad), counts per turn (0: exact), the winch it is on (None: its own), the sign of its turns (1, -1), and whether
    its cable has a sensor of tension. Raises ModelError for numbers that no wiring has."""

    scale: ArrayLike = 1.0
    zero: ArrayLike = 0.0
    counts: ArrayLike = 0
    winch: ArrayLike | None = None
    sign: ArrayLike = 1.0
    sensor: ArrayLike = False

    def array(self, count: int) -> Array:
        """Their numbers (m, 6) as kernels read them. Raises ModelError for winches that are not each of them once."""
        winch = np.arange(count) if self.winch is None else np.asarray(self.winch)
        once = sorted(winch.ravel().tolist()) == list(range(count))
        require(once, "every winch has one channel", key="winch", found=winch.tolist(), expected=f"0 to {count - 1}")
        scale, zero, counts = (
            each_number(key, getattr(self, key), count, expected)
            for key, expected in (("scale", ""), ("zero", ""), ("counts", "0 or more"))
        )
        sign = each_number("sign", self.sign, count, "")
        turns = bool((np.abs(sign) == 1).all()), bool((scale != 0).all())
        require(turns[0], "a motor turns one way or the other", key="sign", found=sign.tolist(), expected="1 or -1")
        require(turns[1], "an encoder that shows nothing", key="scale", found=scale.tolist(), expected="not 0")
        size = np.divide(2 * math.pi, counts, out=np.zeros(count), where=counts > 0)
        sensor = np.broadcast_to(np.asarray(self.sensor, float), count)
        return as_kernel_array(np.column_stack([scale, zero, size, winch, sign, sensor]))

    def readings(self, driven: Driven) -> Array:
        """What the encoders (m,) show, rad."""
        numbers = self.array(len(driven.motors))
        shown = numbers[:, 0] * driven.motors[numbers[:, 3].astype(int), 0] + numbers[:, 1]
        size = numbers[:, 2]
        return np.asarray(np.where(size > 0, np.floor(shown / np.where(size > 0, size, 1.0) + 0.5) * size, shown))

    def sensed(self, driven: Driven) -> Array:
        """What sensors of tension (m,) show, N; not a number where there is none."""
        tension = driven.motion.tension
        return np.where(np.broadcast_to(np.asarray(self.sensor, bool), tension.shape), tension, math.nan)

    def torque(self, told: ArrayLike) -> Array:
        """What the motors of the winches (m,) do when their channels are told so, N m."""
        given = np.asarray(told, float)
        out = np.empty(given.shape)
        out[self.array(len(given))[:, 3].astype(int)] = np.asarray(self.sign, float) * given
        return out


@record(eq=False)
class FollowLog:
    """What a run was, row by row (n): time (s), true state (n, 13) of the plant, believed pose (n, 4, 4), rms of the lengths (m), what was
    left of the way (n, 2) in m and rad, and what encoders showed (n, m), torques (n, m) and tensions (n, m)."""

    time: Array
    state: Array
    pose: Array
    residual: Array
    left: Array
    angles: Array
    torque: Array
    tension: Array


@record(eq=False)
class Followed:
    """Where a run ended: the controller's state, the plant's, how long it took (s), and its log."""

    state: PlatformState
    driven: Driven
    seconds: float
    log: FollowLog


def follow(
    controller: PlatformController,
    state: PlatformState,
    plant: WinchPlant,
    driven: Driven,
    goal: ArrayLike,
    seconds: float,
    *,
    wiring: Wiring | None = None,
    settle: float = 0.0,
    step: float = 1e-3,
    every: int = 1,
    load: ArrayLike = 0.0,
) -> Followed:
    """Controller and plant for so many seconds towards a goal (4, 4), or until it has stood there for `settle` s (0: to the end), or until
    brakes close. step (s): of the plant, at most; every: periods per row of the log; load (6,) beside the weight, N and N m.

    Raises ModelError for times and steps that are none, for a controller or a state of another robot, and for what is no load.
    """
    platform, m, period = plant.platform, len(plant.first), controller.period
    require(
        len(controller.winches) == m,
        "a controller of another robot",
        key="cables",
        found=len(controller.winches),
        expected=m,
    )
    controller.check_state(state)
    target = as_kernel_array(goal)
    require(target.shape == (4, 4), "an array of another shape", key="goal", found=target.shape, expected=(4, 4))
    require(every >= 1, "no such number of periods", key="every", found=every, expected="1 or more")
    require(0 <= settle < math.inf, "no such time", key="settle", found=settle, expected="0 s or more")
    steps = plant.steps(driven.motion.rest, period, step)
    plant.steps(driven.motion.rest, seconds, step)
    ticks = round(seconds / period)
    put = wiring or Wiring()
    new = state.copy()
    x, motors = platform.state(driven.motion), as_kernel_array(driven.motors.copy())
    tension = as_kernel_array(driven.motion.tension.copy())
    limit = as_kernel_array(np.broadcast_to(np.asarray(plant.winches.limit, float), m))
    total = platform.total(load)
    numbers, curves, first = plant.winches.array(m), plant.winches.tables(m), as_kernel_array(plant.first)
    rows = np.zeros((ticks // every, HEAD + 3 * m))
    done = controlled(
        *controller.arrays, target, put.array(m), new.now, new.drum, new.memory,
        x, platform.cables, platform.body, platform.free, total, numbers, curves, first, motors, limit, tension,
        steps, ticks, round(settle / period), every, rows,
    )  # fmt: skip
    rows = rows[: done // every]
    drum = motors[:, 0] / numbers[:, 2]
    rest = plant.first + drum * (numbers[:, 0] + 0.5 * numbers[:, 1] * drum)
    pose = np.tile(np.eye(4), (len(rows), 1, 1))
    pose[:, :3] = rows[:, 13:25].reshape(-1, 3, 4)
    log = FollowLog(
        np.asarray(period * every * np.arange(1, len(rows) + 1), float), rows[:, :13], pose, rows[:, 25], rows[:, 26:28],
        rows[:, HEAD : HEAD + m], rows[:, HEAD + m : HEAD + 2 * m], rows[:, HEAD + 2 * m :],
    )  # fmt: skip
    return Followed(new, Driven(platform.motion(x, rest, tension), motors), done * period, log)
