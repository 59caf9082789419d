"""A platform under its controller: it arrives where it believes to be, and stops where it must."""

from __future__ import annotations

import numpy as np
import pytest
from simulation.test_platform import A, B
from simulation.test_platform import robot as exact

from robocal.cables.cable_lengths import inverse
from robocal.cables.geometry import CableRobot, cable_robot
from robocal.cables.prepared import Drums, Prepared
from robocal.cables.tension import hold
from robocal.control.driver import drive
from robocal.control.platform.platform_controller import (
    MotionLimits,
    PlatformController,
    PlatformState,
    SafeLimits,
    platform_controller,
)
from robocal.drives.cogging import Cogging
from robocal.geometry import se3
from robocal.simulation.platform.platform_plant import plant_of
from robocal.simulation.platform.rig_run import Wiring, follow
from robocal.simulation.platform.simulated_driver import SimulatedDriver
from robocal.simulation.platform.winch_plant import Driven, Winches, WinchPlant

DRUMS = Drums.of(0.04, 4.0)


def robot(shift: np.ndarray | float = 0.0, **more: object) -> CableRobot:
    """The robot of the plant's tests, with anchors elsewhere."""
    return cable_robot("eight", A + shift, B, elasticity=1 / 40000, **more) if np.any(shift) else exact(**more)


def rig(machine: CableRobot, at: np.ndarray | None = None, **more: object) -> tuple[WinchPlant, Driven]:
    """A plant at rest at a pose or its home, held by the middle of its limits."""
    pose = machine.home if at is None else at
    tension = hold(machine, pose[None], "mid").tension[0]
    rest = inverse(machine, pose[None], tension)[0][0] + machine.zeros
    winches = Winches(**({"radius": 0.04, "inertia": 3e-4, "gear": 4.0, "coulomb": 0.02, "viscous": 1e-3} | more))
    plant = WinchPlant(plant_of(machine, damping=30.0), winches, rest)
    return plant, plant.still(pose)


def commander(
    machine: CableRobot, driven: Driven, wiring: Wiring, **more: object
) -> tuple[PlatformController, PlatformState]:
    made = platform_controller(Prepared(machine, method="mid"), DRUMS, torque_limit=3.0, **more)
    return made.power_up(machine.home, wiring.readings(driven))


def few() -> CableRobot:
    """A heavier one with narrow limits."""
    return robot(mass=10.0, limits=np.tile([20.0, 200.0], (8, 1)))


def test_it_arrives():
    machine = few()
    plant, driven = rig(machine)
    wiring = Wiring(zero=np.linspace(-3, 3, 8), counts=16384)
    controller, state = commander(machine, driven, wiring)
    goal = se3.displace(machine.home, [0.3, -0.2, 0.2], [0.02, 0.04, -0.03])
    run = follow(controller, state, plant, driven, goal, 10.0, wiring=wiring, settle=0.2)
    assert not run.state.stop and run.state.arrived and run.seconds < 4.0
    assert np.abs(run.state.pose - goal)[:3, 3].max() < 5e-4
    assert np.abs(run.driven.motion.pose - goal)[:3, 3].max() < 3e-3  # stretch and friction, which encoders do not see
    assert run.log.tension.min() > 15 and run.log.tension.max() < 210


def away(machine: CableRobot, far: float = 1.0) -> np.ndarray:
    return se3.displace(machine.home, far * np.array([0.2, -0.15, 0.15]), far * np.array([0.02, 0.03, -0.02]))


def test_it_arrives_with_anchors_wrong_by_30_mm():
    machine = few()
    shift = 0.03 * np.random.default_rng(5).standard_normal(machine.a.shape)
    true = robot(mass=10.0, limits=machine.limits, shift=shift)
    plant, driven = rig(true, at=machine.home)
    wiring = Wiring(zero=1.0, counts=16384)
    controller, state = commander(machine, driven, wiring)
    for goal in (away(machine), away(machine, -1.0)):
        run = follow(controller, state, plant, driven, goal, 12.0, wiring=wiring, settle=0.2)
        assert run.state.arrived and np.abs(run.state.pose - goal).max() < 2e-3
        assert run.log.tension.min() > 10 and run.log.tension.max() < 220
        state, driven = run.state, run.driven


def test_new_parameters_move_nothing_by_a_step():
    machine = few()
    shift = 0.03 * np.random.default_rng(6).standard_normal(machine.a.shape)
    true = robot(mass=10.0, limits=machine.limits, shift=shift)
    plant, driven = rig(true, at=machine.home)
    wiring = Wiring(zero=1.0, counts=16384)
    start = wiring.readings(driven)
    controller, state = commander(machine, driven, wiring)
    goal = away(machine)
    first = follow(controller, state, plant, driven, goal, 4.0, wiring=wiring)
    known = Prepared(true, method="mid")
    right = platform_controller(known, DRUMS, torque_limit=3.0).power_up(machine.home, start)[0]
    run = follow(controller.change(known, right.zeros), first.state, plant, first.driven, goal, 12.0, wiring=wiring)
    for places in (run.log.pose[:, :3, 3], run.log.state[:, :3]):
        assert np.linalg.norm(np.diff(places, axis=0), axis=1).max() < 1e-4
    off = [np.linalg.norm(r.driven.motion.pose[:3, 3] - goal[:3, 3]) for r in (first, run)]
    assert off[1] < 3e-3 < off[0]
    assert np.array_equal(run.state.now, controller.change(known, right.zeros).cables)


@pytest.mark.parametrize("correct", [False, True])
def test_stretch_is_reported_and_corrected_when_asked(correct):
    machine = few()
    plant, driven = rig(machine, coulomb=0.0)
    controller, state = commander(machine, driven, Wiring(), correct_stretch=correct)
    run = follow(controller, state, plant, driven, away(machine, 1.5), 10.0, settle=1.0)
    off = run.driven.motion.pose[:3, 3] - run.state.pose[:3, 3]
    assert np.linalg.norm(off - run.state.unseen[:3]) < 3e-4
    assert bool(np.linalg.norm(off) < 3e-4) is correct
    assert np.abs(run.state.stretch).max() > 1e-3


WRONG = {
    "lengths-disagree": {"winch": [1, 0, 2, 3, 4, 5, 6, 7]},
    "motor-does-not-follow": {"sign": [1, 1, -1, 1, 1, 1, 1, 1]},
}


@pytest.mark.parametrize("word", sorted(WRONG))
def test_wrong_wiring_closes_the_brakes(word):
    machine = few()
    plant, driven = rig(machine)
    wiring = Wiring(counts=16384, **WRONG[word])
    controller, state = commander(machine, driven, wiring)
    run = follow(controller, state, plant, driven, away(machine), 8.0, wiring=wiring)
    assert run.state.stop in WRONG and run.seconds < 4.0
    assert np.linalg.norm(run.driven.motion.pose[:3, 3] - machine.home[:3, 3]) < 0.3


def test_half_the_counts_fit_no_pose():
    machine = few()
    plant, driven = rig(machine)
    wiring = Wiring(counts=16384, scale=[1, 1, 0.5, 1, 1, 1, 1, 1])
    controller, state = commander(machine, driven, wiring, safe=SafeLimits(residual=0.005))
    run = follow(controller, state, plant, driven, away(machine), 8.0, wiring=wiring)
    assert run.state.stop == "lengths-disagree" and run.seconds < 3.0


@pytest.mark.parametrize(("kept", "word"), [((-5.0, 1e3), "cable-slack"), ((-60.0, 5.0), "cable-overloaded")])
def test_sensors_of_tension_stop_it(kept, word):
    machine = few()
    plant, driven = rig(machine)
    tension, down = driven.motion.tension, [0, 0, -60.0, 0, 0, 0]
    safe = SafeLimits(least=tension.min() + kept[0], most=tension.max() + kept[1])
    for wiring, expected in ((Wiring(counts=16384, sensor=True), word), (Wiring(counts=16384), "")):
        controller, state = commander(machine, driven, wiring, safe=safe)
        run = follow(controller, state, plant, driven, machine.home, 3.0, wiring=wiring, load=down)
        assert run.state.stop == expected and (run.state.cable is None) is (expected == "")
        assert np.linalg.norm(run.log.state[-1, 7:10]) < 0.01


def test_a_goal_that_cannot_be_held_stops_it_on_the_way():
    machine = few()
    plant, driven = rig(machine)
    wiring = Wiring(counts=16384)
    controller, state = commander(machine, driven, wiring)
    run = follow(
        controller, state, plant, driven, se3.displace(machine.home, [1.6, 1.9, 1.2], np.zeros(3)), 12.0, wiring=wiring
    )
    assert run.state.stop == "no-tensions" and run.seconds == pytest.approx(12.0)
    assert np.linalg.norm(run.log.state[-1, 7:10]) < 0.02


def test_the_driver_is_the_same_loop():
    machine = few()
    plant, driven = rig(machine)
    wiring = Wiring(zero=0.5, counts=16384)
    controller, state = commander(machine, driven, wiring)
    run = follow(controller, state, plant, driven, away(machine), 0.05, wiring=wiring)
    driver = SimulatedDriver(plant, driven, wiring)
    end = drive(controller, state, driver, away(machine), 0.05)
    assert np.abs(end.pose - run.state.pose).max() < 1e-5  # one count of an encoder
    assert np.abs(driver.driven.motion.pose - run.driven.motion.pose).max() < 1e-6


def test_cogging_that_is_known_disturbs_as_none():
    machine, curve = few(), Cogging((4, 18), (0.06, 0.05), (0.02, 0.0))
    table = np.broadcast_to(curve.at(np.linspace(0, 2 * np.pi, 721)), (2, 8, 721))
    rough = []
    for cogging, tables in (((curve,), None), ((curve,), table), ((), None)):
        plant, driven = rig(machine, cogging=cogging, coulomb=0.0)
        wiring = Wiring(counts=16384)
        controller, state = commander(machine, driven, wiring, tables=tables)
        run = follow(controller, state, plant, driven, away(machine), 6.0, wiring=wiring)
        rough.append(np.diff(run.log.state[300:700, 7:10], axis=0).std())
    unknown, known, none = rough
    print(f"changes of speed in a period {unknown:.2e}, {known:.2e}, without cogging {none:.2e} m/s")
    assert known - none < 0.2 * (unknown - none)


def test_joints_arrive_too():
    machine = few()
    plant, driven = rig(machine)
    wiring = Wiring(counts=16384)
    controller, state = commander(machine, driven, wiring, motion=MotionLimits(space="joints"))
    goal = away(machine, 0.2)
    run = follow(controller, state, plant, driven, goal, 6.0, wiring=wiring, settle=0.2)
    assert run.state.arrived and np.abs(run.state.pose - goal).max() < 2e-3
