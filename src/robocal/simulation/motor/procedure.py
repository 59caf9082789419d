"""The two runs of the procedure: a slow sweep in both directions from which a cogging is identified, and the ramp that tests it.

The sweep is driven by a proportional controller, so that the torque has the sign of the motion. It begins an eighth of a turn before the
part that is recorded. The ramp turns for a few turns until its integral is at rest, and is judged on a part of a turn.
Source: seed document, 1.3, 1.4.2 and 1.5.
"""

from __future__ import annotations

import math

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.control.pid import ControlLaw
from robocal.simulation.motor.motor_run import LookUp, MotorLog, ramp, run
from robocal.simulation.motor.plant import MotorPlant

__all__ = ["RampTest", "SweepPlan", "Tracking", "TrackingGain", "compare", "sweep", "tracking"]

TURN = 2 * math.pi
RUN_IN = TURN / 8  # of a sweep, before what is recorded


@record
class SweepPlan:
    """Speed (rad/s) and turns of a sweep, periods of controller and log (s), and the noise of the recorded torque (N m)."""

    speed: float = math.radians(3.0)
    turns: float = 2.0
    period: float = 1e-3
    log_period: float = 1e-2
    noise: float = 0.0


@record
class RampTest:
    """Speed of a ramp (rad/s), turns before it is judged, part of a turn that is judged, and the controller's period (s)."""

    speed: float = math.radians(22.0)
    warm_up: float = 3.0
    window: float = 1 / 6
    period: float = 1e-3
    filter_time: float = 0.0


@record
class Tracking:
    """How a ramp was followed: rms of the position error (rad), largest torque of the controller (N m), largest speed error (rad/s)."""

    position: float
    effort: float
    speed: float


@record
class TrackingGain:
    """By how much compensation divides each number of `Tracking`."""

    position: float
    effort: float
    speed: float


def sweep(
    plant: MotorPlant, gain: float, plan: SweepPlan, direction: int, rng: np.random.Generator
) -> tuple[MotorLog, Array]:
    """The sweep in one direction (1, -1) under a proportional gain (N m/rad); and the torque (m,) as it was recorded, with its noise."""
    law = ControlLaw(gain, period=plan.period, limit=plant.torque_limit)
    first = -RUN_IN if direction > 0 else TURN * plan.turns + RUN_IN
    reference = ramp(first, direction * plan.speed, (RUN_IN + TURN * plan.turns) / plan.speed, plan.period)
    every = max(1, round(plan.log_period / plan.period))
    log = run(plant, law, reference).rows(round(RUN_IN / plan.speed / plan.period), every)
    return log, log.torque + rng.normal(0.0, plan.noise, len(log))


def tracking(
    plant: MotorPlant, gains: tuple[float, float, float], test: RampTest, added: LookUp | None = None
) -> tuple[MotorLog, Tracking]:
    """The ramp under a PID controller of gains kp, ki, kd: the rows that are judged, and what they are judged by."""
    law = ControlLaw(*gains, period=test.period, filter_time=test.filter_time, limit=plant.torque_limit)
    turns = test.warm_up + test.window
    whole = run(plant, law, ramp(0.0, test.speed, turns * TURN / abs(test.speed), test.period), added)
    log = whole.rows(round(test.warm_up * TURN / abs(test.speed) / test.period))
    error = log.reference - log.angle
    worst = float(np.abs(log.speed - test.speed).max())
    return log, Tracking(float(np.sqrt(np.mean(error**2))), float(np.abs(log.effort).max()), worst)


def compare(without: Tracking, compensated: Tracking) -> TrackingGain:
    """What compensation divides the numbers of a ramp by."""
    names = ("position", "effort", "speed")
    return TrackingGain(*(getattr(without, name) / getattr(compensated, name) for name in names))
