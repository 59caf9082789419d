"""The platform on elastic cables: laws of mechanics, the statics' own tensions, the order of the steps, and MuJoCo."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.cables.cable_lengths import inverse
from robocal.cables.geometry import CableRobot, cable_robot
from robocal.cables.tension import hold
from robocal.errors import ModelError
from robocal.files.cable.mjcf import mjcf
from robocal.geometry import se3, so3
from robocal.geometry.gravity import GRAVITY
from robocal.simulation.platform.platform_plant import Motion, PlatformPlant, plant_of

A = 1e-3 * np.array([
    [-1716.1, -2101.8, 844.4], [-1616.5, 2085.4, 892.5], [1483.5, 1977.1, 892.7], [1522.4, -2237.0, 789.0],
    [-2044.9, -1787.4, 2974.1], [-1369.5, 2312.9, 2856.3], [1682.8, 2019.9, 2791.0], [921.9, -2443.1, 2869.0],
])  # fmt: skip
B = np.array([0.3, 0.1, -0.1]) * np.sign(A - A.mean(axis=0))
STEPS = (1e-3, 5e-4, 2.5e-4)


def robot(**more: object) -> CableRobot:
    known: dict[str, object] = {"mass": 5.0, "limits": np.tile([20.0, 400.0], (8, 1)), **more}
    return cable_robot("eight", A, B, elasticity=1 / 40000, **known)


def skew() -> CableRobot:
    """A platform whose centre of mass is not its origin, and whose principal axes are not its own."""
    turn = so3.exp([0.3, -0.5, 0.7])
    return robot(com=np.array([0.02, -0.03, 0.05]), inertia=turn @ np.diag([0.04, 0.15, 0.17]) @ turn.T)


def rest_of(machine: CableRobot, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unstretched lengths and tensions at rest."""
    tension = hold(machine, pose[None]).tension[0]
    return inverse(machine, pose[None], tension)[0][0] + machine.zeros, tension


def kicked(plant: PlatformPlant, machine: CableRobot, speed=(0.2, 0.0, 0.0), momentum=(0.0, 0.0, 0.0)) -> Motion:
    rest, tension = rest_of(machine, machine.home)
    return Motion(machine.home, np.array(speed), np.array(momentum), rest, tension)


@pytest.mark.parametrize("machine", [robot(), skew()])
def test_it_stands_where_the_statics_hold_it(machine):
    plant = plant_of(machine, damping=30.0)
    for shift in ([0, 0, 0, 0, 0, 0], [0.3, -0.2, 0.2, 0.05, 0.1, -0.05]):
        pose = se3.displace(machine.home, shift[:3], shift[3:])
        rest, tension = rest_of(machine, pose)
        start = plant.still(pose, rest)
        assert np.abs(start.tension - tension).max() < 1e-6
        later = plant.run(start, 5.0)
        assert np.abs(later.pose - pose).max() < 1e-12
        assert np.abs(later.tension - tension).max() < 1e-6


@pytest.mark.parametrize("method", ["verlet", "runge-kutta"])
def test_slack_cables_pull_with_nothing_and_it_falls_freely(method):
    machine = skew()
    plant = plant_of(machine, damping=30.0)
    rest, _ = rest_of(machine, machine.home)
    fall = plant.run(plant.still(machine.home, rest + 0.5), 0.1, method=method)
    assert (fall.tension == 0.0).all()
    moved = fall.pose[:3, 3] - machine.home[:3, 3]
    assert np.abs(moved - 0.5 * np.array(GRAVITY) * 0.1**2).max() < 1e-15
    assert np.abs(fall.pose[:3, :3] - machine.home[:3, :3]).max() < 1e-15


def test_a_free_platform_keeps_its_momentum_and_its_energy():
    machine = skew()
    plant = plant_of(machine)
    start = Motion(machine.home, np.array([0.1, 0.2, 0.3]), np.array([0.05, -0.02, 0.1]), np.full(8, 1e3), np.zeros(8))
    away = -plant.weight
    later = plant.run(start, 20.0, load=away)
    assert (later.momentum == start.momentum).all() and (later.velocity == start.velocity).all()
    before, after = (sum(plant.energy(m)[::2]) for m in (start, later))
    assert abs(after / before - 1) < 1e-7
    exact = plant.run(start, 2.0, 1e-4, load=away, method="runge-kutta")
    short = plant.run(start, 2.0, 1e-4, load=away)
    assert np.abs(short.pose - exact.pose).max() < 1e-7


def test_without_dampers_the_energy_does_not_drift():
    machine = robot()
    plant = plant_of(machine)
    start = kicked(plant, machine)
    kick = plant.energy(start)[0]
    off = [(sum(plant.energy(plant.run(start, t))) - sum(plant.energy(start))) / kick for t in (10.0, 20.0, 30.0)]
    assert np.abs(off).max() < 0.02  # it swings with the vibration, and does not grow
    assert plant.run(start, 0.5).tension.min() > 0


@pytest.mark.parametrize(("method", "order"), [("verlet", 2), ("runge-kutta", 4)])
def test_the_order_of_the_steps(method, order):
    machine = skew()
    plant = plant_of(machine, damping=30.0)
    # so little that no cable becomes slack: a clipped force has a corner, where no method keeps its order
    start = kicked(plant, machine, (0.03, 0.02, -0.02), (1e-3, -2e-3, 1e-3))
    speed = 1e-3 * np.sin(np.arange(8))
    exact = plant.run(start, 0.2, 1e-5, speed=speed, method="runge-kutta").pose
    off = [np.abs(plant.run(start, 0.2, h, speed=speed, method=method).pose - exact).max() for h in STEPS]
    found = np.log2(np.array(off[:-1]) / off[1:])
    print(f"{method}: errors {off}, orders {found}")
    assert np.abs(found - order).max() < 0.15


def test_steps_of_a_millisecond_are_fine_enough():
    machine = robot()
    plant = plant_of(machine, damping=30.0)
    start = kicked(plant, machine)
    exact = plant.run(start, 0.2, 2e-6, method="runge-kutta").pose[:3, 3]
    off = [float(np.linalg.norm(plant.run(start, 0.2, h).pose[:3, 3] - exact)) for h in (1e-3, 1e-4)]
    print(f"off after 0.2 s: {off[0]:.2g} m in steps of 1 ms, {off[1]:.2g} m of 0.1 ms; asked: 5e-6, 5e-8")
    assert off[0] < 5e-6 and off[1] < 5e-8


def test_mujoco_goes_the_same_way():
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'robocal[oracles]'")
    machine = skew()
    model = mujoco.MjModel.from_xml_string(mjcf(machine).replace('"implicitfast"', '"RK4"'))
    model.opt.timestep = 1e-5
    # the dampers that the file assumes
    plant = plant_of(machine, damping=-model.actuator_biasprm[:, 2])
    start = kicked(plant, machine)
    data = mujoco.MjData(model)
    data.qpos[:] = [*machine.home[:3, 3], 1, 0, 0, 0]
    # MuJoCo's velocity is that of the frame's origin, and its platform does not turn yet
    data.qvel[:3] = start.velocity
    data.ctrl[:] = 1 / start.rest
    mujoco.mj_step(model, data, 20000)
    exact = plant.run(start, 0.2, 1e-5, method="runge-kutta")
    gap = float(np.abs(data.qpos[:3] - exact.pose[:3, 3]).max())
    print(f"MuJoCo and this plant are {gap:.2g} m apart after 0.2 s; asked: 1e-8")
    assert gap < 1e-8


def test_a_planar_platform_stays_in_its_plane():
    a = np.array([[-2.0, 0, 0.2], [2.0, 0, 0.2], [-2.0, 0, 3.0], [2.0, 0, 3.0]])
    b = np.array([[-0.2, 0, 0.1], [0.2, 0, 0.1], [-0.2, 0, -0.1], [0.2, 0, -0.1]])
    limits = np.tile([10.0, 500.0], (4, 1))
    machine = cable_robot("plane", a, b, elasticity=2e-5, mass=4.0, limits=limits, degrees="1R2T", plane="xz")
    plant = plant_of(machine, damping=20.0)
    rest, tension = rest_of(machine, machine.home)
    start = Motion(machine.home, np.array([0.1, 0.0, 0.1]), np.array([0.0, 0.01, 0.0]), rest, tension)
    later = plant.run(start, 3.0)
    assert later.pose[1, 3] == machine.home[1, 3] and np.abs(later.pose[1, :3] - [0, 1, 0]).max() < 1e-12
    assert np.abs(later.pose - machine.home).max() < 5e-4 < np.abs(plant.run(start, 0.02).pose - machine.home).max()


@pytest.mark.parametrize(
    ("make", "key"),
    [
        (lambda: plant_of(robot(mass=None)), "mass"),
        (lambda: plant_of(robot(density=np.full(8, 0.1))), "density"),
        (lambda: plant_of(robot(), damping=-1.0), "damping"),
        (lambda: plant_of(robot(), elasticity=0.0), "elasticity"),
        (lambda: plant_of(robot(), inertia=np.diag([1.0, 1.0, 3.0])), "inertia"),
        (lambda: plant_of(robot()).still(robot().home, -1.0), "rest"),
        (lambda: plant_of(robot()).run(plant_of(robot()).still(robot().home, 2.5), 1.0, method="euler"), "method"),
        (lambda: plant_of(robot(), elasticity=1e-9).run(plant_of(robot()).still(robot().home, 2.5), 1.0), "step"),
    ],
)
def test_what_no_plant_has_is_named(make, key):
    with pytest.raises(ModelError) as failure:
        make()
    assert failure.value.key == key
