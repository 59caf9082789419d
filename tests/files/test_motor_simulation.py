"""motor.yaml of a motor to be simulated: what it says is what is simulated, and what is wrong is named by its key."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from robocal.errors import FormatError
from robocal.files.motor_simulation import read_motor_simulation

EXAMPLE = Path(__file__).parents[2] / "examples" / "cogging" / "motor.yaml"
SEED = Path(__file__).parents[3] / "shared" / "data" / "seeds" / "motor-sim.yaml"


def changed(tmp_path, old, new):
    """The example with one text replaced."""
    text = EXAMPLE.read_text(encoding="utf-8")
    assert text.count(old) == 1
    path = tmp_path / "motor.yaml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


def test_amplitudes_and_phases_are_cosines_and_sines():
    motor = read_motor_simulation(EXAMPLE)
    angle = np.linspace(0, 2 * np.pi, 50)
    said = zip((4, 8, 12, 24), (0.06, 0.03, 0.02, 0.012), (0.3, 1.1, -0.7, 2.0), strict=True)
    expected = sum(a * np.cos(n * angle + p) for n, a, p in said)
    np.testing.assert_allclose(motor.plant.cogging.at(angle), expected, atol=1e-15)
    assert math.degrees(motor.plant.cogging.lag) == pytest.approx(0.6)  # half of what is between the directions


def test_the_example_is_the_motor_of_the_seed():
    if not SEED.is_file():
        pytest.skip("needs ../shared/data/seeds/motor-sim.yaml")
    own, seed = read_motor_simulation(EXAMPLE), read_motor_simulation(SEED)
    assert own.plant.torque_limit == pytest.approx(0.561 * 22.8) and math.isinf(seed.plant.torque_limit)
    assert (own.sweep, own.gains, own.escapes, own.ramp, own.controllers) == (
        seed.sweep,
        seed.gains,
        seed.escapes,
        seed.ramp,
        seed.controllers,
    )
    np.testing.assert_allclose(own.plant.array[:-2], seed.plant.array[:-2])


@pytest.mark.parametrize(
    ("old", "new", "key", "words"),
    [
        ("breakaway_N_m: 0.11", "breakaway_N_m: 0.09", "friction.breakaway_N_m", "too small"),
        ("rotor_inertia_kg_m2: 1.13e-4", "rotor_inertia_kg_m2: 0", "rotor_inertia_kg_m2", "greater than 0"),
        ("rotor_inertia_kg_m2", "rotor_inertia", "rotor_inertia", "unknown key"),
        ("phases_rad: [0.3, 1.1, -0.7, 2.0]", "phases_rad: [0.3, 1.1]", "cogging.phases_rad", "each order"),
        ("[4, 8, 12, 24]", "[4, 8, 8, 24]", "cogging.orders_per_turn", "twice"),
        ("[5, 50, 0.03]", "[5, 50]", "test_ramp.pid[1]", "PID"),
        ("rate_Hz: 1000", "rate_Hz: .nan", "controller.rate_Hz", ""),
        ("log_rate_Hz: 100", "log_rate_Hz: 5000", "identification.log_rate_Hz", "faster"),
        ("{speed_deg_s: 22", "{speed_deg_s: 1e-6", "test_ramp.speed_deg_s", "too long"),
        ("directions: both", "directions: forward", "identification.directions", "unknown value"),
        ("kind: motor-simulation", "kind: motor", "kind", "unknown value"),
        ("torque_noise_N_m: 0.02", "torque_noise_N_m: -1", "identification.torque_noise_N_m", ""),
    ],
)
def test_what_is_wrong_is_named(tmp_path, old, new, key, words):
    with pytest.raises(FormatError) as caught:
        read_motor_simulation(changed(tmp_path, old, new))
    assert caught.value.key == key and words in str(caught.value)
