"""Runs of a motor: a reference in, what a controller would record out, with the truth beside it."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import as_kernel_array
from robocal._record import record
from robocal._types import Array
from robocal.control.pid import ControlLaw
from robocal.drives.cogging import Cogging
from robocal.simulation.motor._kernels import run_motor
from robocal.simulation.motor.plant import MotorPlant

__all__ = ["LookUp", "MotorLog", "compensation", "ramp", "run"]

LONGEST_STEP = 1e-4  # s: a fifth of a radian of the fastest oscillation, that of the rotor on its bristles
ENTRIES = 1440  # of a compensation table: 0.25 deg


@record(eq=False)
class MotorLog:
    """One run, a row for each period: desired angle, angle of the encoder, true angle (rad), true speed (rad/s), torque, the part of it
    that the controller asked for, true friction and true cogging (N m); arrays (m,)."""

    period: float
    reference: Array
    encoder: Array
    angle: Array
    speed: Array
    torque: Array
    effort: Array
    friction: Array
    cogging: Array

    def __len__(self) -> int:
        return len(self.reference)

    @property
    def time(self) -> Array:
        """Time of each row (s), from the first."""
        return np.asarray(self.period * np.arange(len(self)), np.float64)

    def rows(self, first: int, every: int = 1) -> MotorLog:
        """The same from a row on, every so many."""
        names = ("reference", "encoder", "angle", "speed", "torque", "effort", "friction", "cogging")
        return MotorLog(every * self.period, *(getattr(self, name)[first::every] for name in names))


@record(eq=False)
class LookUp:
    """Torque to add at equally spaced angles of one turn, for the direction forward and for the reverse: (2, k) N m."""

    tables: Array


def compensation(cogging: Cogging, friction: float = 0.0, offset: float = 0.0) -> LookUp:
    """The tables of a cogging, with the mean of each direction: offset plus or minus the friction. Both 0: tables without a mean."""
    angle = 2 * math.pi * np.arange(ENTRIES) / ENTRIES
    return LookUp(np.stack([offset + d * friction + cogging.at(angle, d) for d in (1.0, -1.0)]))


def ramp(start: float, speed: float, duration: float, period: float) -> Array:
    """Desired angles (rad), one for each period and one more, from `start` on at a speed (rad/s) for a duration (s)."""
    return np.asarray(start + speed * period * np.arange(round(duration / period) + 1), np.float64)


def run(plant: MotorPlant, law: ControlLaw, reference: Array, added: LookUp | None = None) -> MotorLog:
    """A motor that starts at rest, at the first desired angle, and follows `reference` (m + 1,)."""
    log = np.empty((len(reference) - 1, 8))
    start = float(reference[0])
    state = np.array([start, 0.0, 0.0, start, 0.0, 0.0, 0.0])
    tables = np.zeros((2, 0)) if added is None else added.tables
    orders, cosine, sine, tables, reference = as_kernel_array(
        plant.cogging.orders, plant.cogging.cosine, plant.cogging.sine, tables, reference
    )
    steps = max(1, math.ceil(law.period / LONGEST_STEP - 1e-9))
    run_motor(plant.array, orders, cosine, sine, law.array, tables, reference, steps, state, log)
    return MotorLog(law.period, *log.T.copy())
