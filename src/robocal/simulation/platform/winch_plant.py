"""Winches under a platform: motors with inertia, Dahl's friction, cogging, a gear, and drums on which layers build up.

    J dw/dt = rho t - torque - friction - cogging(angle)        rho = (r + r' a) / g,  a = angle / g
    friction = F_c z / z_c + v w        dz/dt = w - |w| z / z_c        rest = l_0 + a (r + r' a / 2)

The angle is that of the motor; where it grows, cable runs out. torque winds it in, and is cut off at the motor's limit. An encoder counts
the motor's turns from wherever it was when power came on. Sources: seed document, 1.3 and 3.7.1; P. Dahl, A solid friction model (1968).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from robocal._jit import as_kernel_array
from robocal._record import record
from robocal._types import Array
from robocal.drives.cogging import Cogging
from robocal.errors import ModelError, require
from robocal.simulation.platform._kernels import winched
from robocal.simulation.platform.platform_plant import STIFF, Motion, PlatformPlant, each_number

__all__ = ["Driven", "WinchPlant", "Winches"]

TABLE = 4096  # entries of a turn: the highest order that a motor has, a hundred of them a period


@record(eq=False)
class Winches:
    """Winches of m cables: radius (m) of drums and its growth (m/rad), gear, inertia (kg m2), Coulomb torque (N m), the angle over which it
    builds up (rad), viscous coefficient (N m s) and largest torque (N m) of motors, counts per turn of the encoder (0: exact). A number
    is that of all, or one of each; `cogging` likewise.

    Raises ModelError for numbers that no winch has.
    """

    radius: ArrayLike
    inertia: ArrayLike
    gear: ArrayLike = 1.0
    growth: ArrayLike = 0.0
    coulomb: ArrayLike = 0.0
    reach: ArrayLike = 0.01
    viscous: ArrayLike = 0.0
    limit: ArrayLike = math.inf
    counts: int = 0
    cogging: tuple[Cogging, ...] = ()

    def __post_init__(self) -> None:
        for key in ("radius", "inertia", "gear", "reach", "limit"):
            values = np.asarray(getattr(self, key), float)
            good = bool((values > 0).all() and (key == "limit" or np.isfinite(values).all()))
            require(good, f"no such {key}", key=key, found=values.tolist(), expected="above 0")
        for key in ("growth", "coulomb", "viscous", "counts"):
            values = np.asarray(getattr(self, key), float)
            good = bool((((values >= 0) | (key == "growth")) & np.isfinite(values)).all())
            require(good, f"no such {key}", key=key, found=values.tolist(), expected="0 or more")

    def array(self, count: int) -> Array:
        """Their numbers (m, 7) as kernels read them. Raises ModelError for another number of cables."""
        keys = ("radius", "growth", "gear", "inertia", "coulomb", "reach", "viscous")
        try:
            columns = [np.broadcast_to(np.asarray(getattr(self, key), float), count) for key in keys]
        except ValueError:
            raise ModelError(
                "a number of every winch, or one of all", key="winches", expected=f"{count} numbers"
            ) from None
        return as_kernel_array(np.column_stack(columns))

    def tables(self, count: int) -> Array:
        """What motors ask for over one turn (m, k + 1) in N m; k = 0 without cogging. Raises ModelError for another number of motors."""
        if not self.cogging:
            return np.zeros((count, 1))
        curves = self.cogging if len(self.cogging) == count else self.cogging * count
        require(
            len(curves) == count,
            "a cogging of every motor, or one of all",
            key="cogging",
            found=len(self.cogging),
            expected=count,
        )
        turn = np.linspace(0.0, 2 * math.pi, TABLE + 1)
        return as_kernel_array(np.stack([c.at(turn) for c in curves]))


@record(eq=False)
class Driven:
    """A platform in motion with its motors: angle (rad), speed (rad/s) and bristle (rad) of each, (m, 4) with a column without use."""

    motion: Motion
    motors: Array


@record(eq=False)
class WinchPlant:
    """A platform and its winches; `first` (m,) are the unstretched lengths where the motors stand at 0."""

    platform: PlatformPlant
    winches: Winches
    first: Array

    def still(self, pose: ArrayLike) -> Driven:
        """At rest at a pose with the motors at 0."""
        motors = np.zeros((len(self.first), 4))
        return Driven(self.platform.still(pose, self.first), motors)

    def run(
        self, driven: Driven, torque: ArrayLike, seconds: float, step: float = 1e-3, *, load: ArrayLike = 0.0
    ) -> Driven:
        """The motion so many `seconds` later at constant torques (m,) of the motors in N m, which wind cable in, in steps of at
        most `step`. Raises ModelError for no such times and for steps that are too long."""
        plant, m = self.platform, len(self.first)
        steps = self.steps(driven.motion.rest, seconds, step)
        limit = np.broadcast_to(np.asarray(self.winches.limit, float), m)
        wanted = as_kernel_array(np.clip(each_number("torque", torque, m, ""), -limit, limit))
        x, motors, tension = plant.state(driven.motion), as_kernel_array(driven.motors.copy()), np.empty(m)
        total = plant.total(load)
        numbers, period = self.winches.array(m), seconds / steps if steps else step
        first = as_kernel_array(self.first)
        curves = self.winches.tables(m)
        body = (plant.cables, plant.body, plant.free, total)
        winched(x, *body, numbers, curves, first, motors, wanted, tension, period, steps)
        drum = motors[:, 0] / numbers[:, 2]
        rest = self.first + drum * (numbers[:, 0] + 0.5 * numbers[:, 1] * drum)
        return Driven(plant.motion(x, rest, tension), motors)

    def steps(self, rest: Array, seconds: float, step: float) -> int:
        """As those of the platform; a motor on its cable, and its friction, may not be too fast for a step either."""
        steps = self.platform.steps(rest, seconds, step)
        numbers, cables = self.winches.array(len(self.first)), self.platform.cables
        arm = (numbers[:, 0] / numbers[:, 2]) ** 2
        spring, damper = arm * cables[:, 3] / rest, arm * cables[:, 4] + numbers[:, 6]
        fastest = float((np.sqrt(spring / numbers[:, 3]) + damper / numbers[:, 3]).max())
        turn, word = seconds / max(steps, 1) * fastest, "the step is too long for such light motors"
        expected = f"below {STIFF * step / max(turn, STIFF):.2g} s"
        require(turn < STIFF, word, key="step", found=f"{step:.3g} s", expected=expected)
        return steps

    def readings(self, driven: Driven) -> Array:
        """Angles (m,) of the motors in rad, as the encoders count them."""
        angle = driven.motors[:, 0]
        if self.winches.counts == 0:
            return angle.copy()
        size = 2 * math.pi / self.winches.counts
        return np.asarray(np.round(angle / size) * size)
