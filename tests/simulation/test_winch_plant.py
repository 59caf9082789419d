"""Winches under a platform: statics, friction that holds, cogging, drums on which layers build up, and the order of the steps."""

from __future__ import annotations

import numpy as np
import pytest
from simulation.test_platform import rest_of, robot

from robocal.drives.cogging import Cogging
from robocal.errors import ModelError
from robocal.simulation.platform.platform_plant import plant_of
from robocal.simulation.platform.winch_plant import Driven, Winches, WinchPlant

RADIUS, GEAR = 0.04, 4.0
DRUMS = {"radius": RADIUS, "inertia": 3e-4, "gear": GEAR}


def plant(**more: object) -> tuple[WinchPlant, np.ndarray]:
    """A plant that torques (m,) hold at home."""
    machine = robot()
    rest, tension = rest_of(machine, machine.home)
    return WinchPlant(plant_of(machine, damping=30.0), Winches(**(DRUMS | more)), rest), RADIUS / GEAR * tension


def off(one: Driven, other: Driven) -> float:
    return float(np.abs(one.motion.pose - other.motion.pose).max())


def test_torques_of_the_statics_hold_it():
    made, torque = plant()
    start = made.still(robot().home)
    later = made.run(start, torque, 5.0)
    assert off(start, later) < 1e-12 and np.abs(later.motors[:, 0]).max() < 1e-10


def test_friction_holds_what_would_move_without_it():
    free, torque = plant()
    rough, _ = plant(coulomb=0.05, reach=1e-3)
    start = free.still(robot().home)
    more = torque + 0.03 * np.sign(np.sin(np.arange(8) + 1))
    moved, held = (made.run(start, more, 1.0) for made in (free, rough))
    assert off(start, held) < 5e-4 < 1e-2 < off(start, moved)
    assert np.abs(held.motors[:, 1]).max() < 1e-3


def test_cogging_pulls_a_motor_to_its_place():
    curve = Cogging((6,), (0.0,), (0.4,))
    made, torque = plant(cogging=(curve,), coulomb=0.02, reach=1e-3, viscous=2e-3)
    start = made.still(robot().home)
    pushed = made.run(start, torque + 0.1, 2.0)
    # a motor rests where table, friction and torque are in balance
    angle, bristle = pushed.motors[:, 0], pushed.motors[:, 2]
    left = RADIUS / GEAR * pushed.motion.tension - torque - 0.1 - 0.02 * bristle / 1e-3 - curve.at(angle)
    assert np.abs(pushed.motors[:, 1]).max() < 1e-4 and np.abs(left).max() < 2e-3
    assert np.abs(pushed.motors[:, 0]).max() > 0.01


def test_a_drum_grows_by_its_layers():
    grown, torque = plant(growth=2e-4)
    start = grown.still(robot().home)
    later = grown.run(start, torque * 0.9, 0.05)
    drum = later.motors[:, 0] / GEAR
    assert np.abs(later.motion.rest - (start.motion.rest + RADIUS * drum + 1e-4 * drum**2)).max() < 1e-15
    assert np.abs(drum).max() > 1e-3


def test_the_order_of_the_steps():
    made, torque = plant(viscous=1e-3, growth=1e-4, cogging=(Cogging((3,), (0.01,), (0.02,)),))
    start = made.still(robot().home)
    shift = torque + 0.01 * np.sin(np.arange(8))
    exact = made.run(start, shift, 0.2, 1e-5)
    errors = [off(made.run(start, shift, 0.2, h), exact) for h in (1e-3, 5e-4, 2.5e-4)]
    print(f"errors {errors}")
    assert np.abs(np.log2(np.array(errors[:-1]) / errors[1:]) - 2).max() < 0.3


def test_encoders_count_and_motors_have_a_limit():
    made, torque = plant(counts=4096, limit=0.5)
    start = made.still(robot().home)
    strong, most = (made.run(start, t, 0.02) for t in (torque + 5.0, np.full(8, 0.5)))
    assert off(strong, most) == 0.0
    shown = made.readings(strong)
    size = 2 * np.pi / 4096
    assert (
        np.abs(shown - strong.motors[:, 0]).max() <= size / 2
        and np.abs(shown / size - np.round(shown / size)).max() < 1e-9
    )


@pytest.mark.parametrize(
    ("more", "key"),
    [
        ({"radius": 0.0}, "radius"),
        ({"coulomb": -1.0}, "coulomb"),
        ({"gear": [1.0, 2.0]}, "winches"),
        ({"cogging": (Cogging(),) * 3}, "cogging"),
    ],
)
def test_what_no_winch_has_is_named(more, key):
    def go() -> None:
        made, torque = plant(**more)
        made.run(made.still(robot().home), torque, 0.01)

    with pytest.raises(ModelError) as failure:
        go()
    assert failure.value.key == key
