"""Laws of a simulated motor: mechanics, friction and hysteresis are as they were asked for, and what the seed says of its motor."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from motors import seed_motor, table_error, thin_estimate

from robocal.control.pid import ControlLaw, ControllerState, step
from robocal.drives.cogging import Cogging
from robocal.errors import ModelError
from robocal.simulation.motor.motor_run import compensation, ramp, run
from robocal.simulation.motor.plant import MotorPlant
from robocal.simulation.motor.procedure import SweepPlan, compare, sweep, tracking

PLAIN = MotorPlant(1e-4, 0.5, Cogging(), 1e-9, 1e-9, 0.05, 0.0, 1.0, 0.0)
COGGED = Cogging((4, 12), (0.05, 0.01), (-0.02, 0.02), math.radians(0.6))
ROUGH = replace(PLAIN, cogging=COGGED, coulomb=0.1, breakaway=0.11, bristle_stiffness=30.0, bristle_damping=None)


def test_a_rotor_on_a_spring_swings_at_its_frequency():
    """A proportional controller of 0.1 N m/rad on 1e-4 kg m2: 0.1987 s."""
    log = run(PLAIN, ControlLaw(0.1, period=1e-4), np.concatenate([[0.0], np.full(10_000, 0.01)]))
    up = np.flatnonzero(np.diff(np.sign(log.angle - 0.01)) > 0)
    assert np.diff(up).mean() * 1e-4 == pytest.approx(2 * math.pi * math.sqrt(1e-4 / 0.1), rel=2e-3)


def test_a_run_obeys_the_equation_of_motion():
    """The torque less friction and cogging accelerates the rotor; step by step, as the log has it."""
    log = run(ROUGH, ControlLaw(5.0, 20.0, 0.01, period=1e-4), ramp(0.0, 2.0, 1.0, 1e-4))
    acceleration = np.diff(log.speed) / 1e-4
    left = (log.torque - log.friction - log.cogging)[:-1]
    np.testing.assert_allclose(ROUGH.inertia * acceleration, left, atol=1e-12)


def test_friction_of_a_turning_rotor_is_coulomb_and_viscous():
    plant = replace(ROUGH, cogging=Cogging(), viscous=2e-3)
    log = run(plant, ControlLaw(1.0, 10.0, 0.02, filter_time=2e-3), ramp(0.0, 10.0, 3.0, 1e-3))
    assert log.torque[-500:].mean() == pytest.approx(0.1 + 2e-3 * 10, rel=1e-3)


def test_a_rotor_sticks_below_the_breakaway_torque():
    """Under a torque that grows slowly it gives way as bristles do: x = -(F_b / s) ln(1 - torque / F_b); and stays there."""
    reference = np.concatenate([np.linspace(0.0, 0.09, 5000), np.full(2000, 0.09)])
    log = run(replace(ROUGH, cogging=Cogging()), ControlLaw(1.0), reference)
    assert log.angle[-1] == pytest.approx(-0.11 / 30 * math.log(1 - log.torque[-1] / 0.11), rel=0.02)
    assert np.abs(log.speed[-500:]).max() < 1e-3


def test_the_cogging_lags_both_directions():
    """Forward and reverse the cogging is that of its lag, once the play is taken up."""
    for d in (1.0, -1.0):
        log = run(replace(ROUGH, counts=0), ControlLaw(20.0), ramp(0.0, d * 0.5, 4.0, 1e-3)).rows(500)
        np.testing.assert_allclose(log.cogging, COGGED.at(log.angle, d), atol=2e-3)


def test_the_encoder_counts():
    log = run(replace(ROUGH, counts=400), ControlLaw(5.0), ramp(0.0, 0.5, 2.0, 1e-3))
    counts = log.encoder * 400 / (2 * math.pi)
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
    assert np.abs(log.encoder - log.angle).max() <= math.pi / 400 * (1 + 1e-9)


def test_the_current_is_limited():
    log = run(replace(ROUGH, current_limit=0.1), ControlLaw(50.0), ramp(0.0, 5.0, 0.5, 1e-3), compensation(COGGED, 0.1))
    assert np.abs(log.torque).max() == pytest.approx(0.05)


def test_the_compiled_loop_takes_the_step_of_control():
    law = ControlLaw(3.0, 40.0, 0.02, filter_time=2e-3, limit=0.15)
    log, state, out = run(ROUGH, law, ramp(0.0, 1.0, 1.0, 1e-3)), ControllerState(), []
    for error in log.reference - log.encoder:
        state, u = step(law, state, error)
        out.append(u)
    np.testing.assert_allclose(log.effort, out, atol=1e-12)
    assert np.abs(out).max() == 0.15


def test_compensation_is_that_of_the_desired_direction():
    """A table for each direction, looked up by the encoder's angle: what is added is the curve with its mean, to the grid's error."""
    added = compensation(COGGED, 0.1, 0.02)
    for d in (1.0, -1.0):
        log = run(ROUGH, ControlLaw(5.0), ramp(0.3, d * 0.5, 2.0, 1e-3), added)
        expected = 0.02 + d * 0.1 + COGGED.at(log.encoder, d)
        np.testing.assert_allclose(log.torque - log.effort, expected, atol=1e-4)


def test_shorter_steps_change_nothing(monkeypatch):
    from robocal.simulation.motor import motor_run

    motor = seed_motor()
    far = tracking(motor.plant, motor.controllers[1], replace(motor.ramp, warm_up=0.2))[1]
    monkeypatch.setattr(motor_run, "LONGEST_STEP", 2.5e-5)
    near = tracking(motor.plant, motor.controllers[1], replace(motor.ramp, warm_up=0.2))[1]
    assert near.position == pytest.approx(far.position, rel=0.02)
    assert near.effort == pytest.approx(far.effort, rel=0.02)


def sweeps(motor, gain, seed=0):
    rng = np.random.default_rng(seed)
    return [sweep(motor.plant, gain, motor.sweep, d, rng) for d in (1, -1)]


@pytest.mark.parametrize("gain", [2.0, 5.0])
def test_the_motor_of_the_seed(gain):
    """Table within 2 % of the peak; position / 3, effort / 6; a table without mean gives about 1.8 in effort."""
    motor = seed_motor()
    logs = sweeps(motor, gain)
    found, friction, offset = thin_estimate([log.encoder for log, _ in logs], [y for _, y in logs], (4, 8, 12, 24))
    assert table_error(found, motor.plant.cogging) < 0.02
    assert math.degrees(found.lag) == pytest.approx(0.6, abs=0.15)
    for pid in motor.controllers:
        without = tracking(motor.plant, pid, motor.ramp)[1]
        full = compare(without, tracking(motor.plant, pid, motor.ramp, compensation(found, friction, offset))[1])
        bare = compare(without, tracking(motor.plant, pid, motor.ramp, compensation(found))[1])
        assert full.position > 3 and full.effort > 6
        assert 1.6 < bare.effort < 2.0


def test_the_rotor_escapes_from_a_low_gain_alone():
    """Figure 1.7: where the cogging falls faster than the gain can follow, the rotor jumps by degrees; and not at gain 2."""
    motor = seed_motor()
    jump = {gain: np.abs(np.diff(sweeps(motor, gain)[0][0].encoder)).max() for gain in (2.0, *motor.escapes)}
    assert jump[2.0] < math.radians(0.3)
    assert all(jump[gain] > math.radians(1.0) for gain in motor.escapes)


@pytest.mark.parametrize(
    "bad",
    [{"inertia": 0.0}, {"breakaway": 0.05}, {"viscous": -1.0}, {"cogging": replace(COGGED, eccentric=(0.01, 0.0))}],
)
def test_what_no_motor_has_is_refused(bad):
    with pytest.raises(ModelError):
        replace(ROUGH, **bad)


def test_a_sweep_is_recorded_at_the_rate_of_its_log():
    plan = SweepPlan(turns=0.05, log_period=0.02, noise=0.02)
    log, torque = sweep(ROUGH, 5.0, plan, -1, np.random.default_rng(0))
    assert len(log) == 300 and log.period == pytest.approx(0.02)
    assert log.reference[0] == pytest.approx(0.05 * 2 * math.pi)
    assert np.std(torque - log.torque) == pytest.approx(0.02, rel=0.15)
