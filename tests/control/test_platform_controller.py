"""The step of a controller of a platform: turns that arrive, trapezoids that stop where they must, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from simulation.test_platform import A, robot

from robocal._jit import as_kernel_array
from robocal.cables.geometry import cable_robot
from robocal.cables.prepared import Drums, Prepared
from robocal.cables.single._kernels import slopes
from robocal.control.platform.platform_controller import (
    MotionLimits,
    PlatformController,
    PlatformState,
    SafeLimits,
    platform_controller,
)
from robocal.errors import ModelError
from robocal.geometry import se3, so3

QUICK = {"gain": 1000.0, "stop": 1e-6, "go": 5e-6, "turn_stop": 1e-6, "turn_go": 5e-6}
HOME = robot().home


def ready(**more: object) -> tuple[PlatformController, PlatformState]:
    """A controller whose motors need not follow, for a platform that does what it is told; crossed cables hold it where it turns."""
    b = np.array([[x, y, z] for z in (-0.3, 0.3) for x, y in ((-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1), (0.1, 0.1))])
    machine = cable_robot("crossed", A, b, mass=5.0, limits=np.tile([0.0, 1e6], (8, 1)))
    motion = MotionLimits(**(QUICK | more))
    made = platform_controller(Prepared(machine), Drums.of(0.04, 4.0), motion=motion, safe=SafeLimits(follow=1e9))
    return made.power_up(HOME, np.zeros(8))


def kinematic(
    made: PlatformController, state: PlatformState, goal: np.ndarray, seconds: float
) -> tuple[np.ndarray, PlatformState]:
    """Poses (n, 4, 4) of a platform that moves as the controller says."""
    pose, full, slope, poses = as_kernel_array(HOME), np.empty(8), np.empty((8, 6)), []
    for _ in range(round(seconds / made.period)):
        slopes(pose, made.cables, full, slope)
        state, _ = made.step(state, goal, (full - made.zeros) / 0.01)
        poses.append(pose)
        v, w = made.period * state.twist[:3], made.period * state.twist[3:]
        pose = as_kernel_array(se3.compose(so3.exp(w) @ pose[:3, :3], pose[:3, 3] + v))
    return np.array(poses), state


def printed(goal: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """The rate (3,) of (3.64) to (3.79) with matrix `goal` in the place of Q_c, by the seed's own constraints and QR."""
    q, zero = turn.T, np.zeros(3)
    rows = (
        (q[0], zero, zero),
        (zero, q[1], zero),
        (zero, zero, q[2]),
        (q[1], q[0], zero),
        (zero, q[2], q[1]),
        (q[2], zero, q[0]),
    )
    own = np.linalg.qr(np.array([np.concatenate(r) for r in rows]).T)[0]
    flat = goal.T.ravel()
    rate = (flat - own @ (own.T @ flat)).reshape(3, 3).T @ turn.T
    return 0.5 * np.array([rate[2, 1] - rate[1, 2], rate[0, 2] - rate[2, 0], rate[1, 0] - rate[0, 1]])


@pytest.mark.parametrize("rotation", ["log", "projection"])
def test_a_turn_of_60_degrees_arrives_at_60(rotation):
    goal = HOME.copy()
    goal[:3, :3] = so3.exp([0.0, 0.0, math.radians(60)])
    made, state = ready(rotation=rotation, turn_speed=1.0, turn_acceleration=2.0)
    poses, state = kinematic(made, state, goal, 2.2)
    assert abs(math.degrees(np.linalg.norm(so3.log(poses[-1][:3, :3]))) - 60) < 1e-3
    assert state.arrived and not state.stop


def test_as_printed_it_stops_at_30_and_the_projection_of_q_is_ours():
    goal = so3.exp([0.0, 0.0, math.radians(60)])
    turn = np.eye(3)
    for _ in range(3000):
        turn = so3.exp(0.01 * printed(goal @ turn.T, turn)) @ turn
    assert math.degrees(np.linalg.norm(so3.log(turn))) == pytest.approx(30, abs=1e-3)
    made, state = ready(rotation="projection")
    start, full, slope = so3.exp([0.1, -0.2, 0.3]), np.empty(8), np.empty((8, 6))
    at = as_kernel_array(se3.compose(start, HOME[:3, 3]))
    made, state = made.power_up(at, np.zeros(8))
    new, _ = made.step(state, se3.compose(goal, HOME[:3, 3]), np.zeros(8))
    expected, rate = printed(goal, start), new.twist[3:]
    assert np.abs(rate / np.linalg.norm(rate) - expected / np.linalg.norm(expected)).max() < 1e-9
    slopes(at, made.cables, full, slope)
    assert np.abs(full - made.zeros).max() < 1e-12  # lengths where motors stand at 0


@pytest.mark.parametrize("path", ["line", "axes"])
@pytest.mark.parametrize("far", [0.003, 0.3])
def test_it_takes_the_time_of_its_trapezoid_and_stops_at_the_goal(path, far):
    way = far * np.array([0.6, -0.64, 0.48])
    goal = se3.displace(HOME, way, np.zeros(3))
    made, state = ready(path=path)
    size = far if path == "line" else np.abs(way).max()
    own = size / 0.3 + 0.3 / 0.5 if size > 0.3**2 / 0.5 else 2 * math.sqrt(size / 0.5)
    poses, state = kinematic(made, state, goal, 1.06 * own + 0.02)
    left = goal[:3, 3] - poses[:, :3, 3]
    assert np.linalg.norm(left[-1]) < 1e-5
    assert (left * np.sign(way)).min() > -1e-5  # no component goes beyond
    speed = np.diff(poses[:, :3, 3], axis=0) / made.period
    limit = np.linalg.norm(speed, axis=1) if path == "line" else np.abs(speed).max(axis=1)
    assert limit.max() < 0.3 + 1e-9
    change = np.diff(speed, axis=0) / made.period
    assert (np.linalg.norm(change, axis=1) if path == "line" else np.abs(change).max(axis=1)).max() < 0.5 + 1e-6
    if path == "line":
        assert np.linalg.norm(np.cross(left, way / far), axis=1).max() < 1e-6


def test_a_goal_that_changes_on_the_way_changes_no_speed_by_a_step():
    made, state = ready()
    first, second = (se3.displace(HOME, [x, y, 0.0], np.zeros(3)) for x, y in ((0.5, 0.0), (-0.2, 0.2)))
    full, slope, pose, speeds = np.empty(8), np.empty((8, 6)), as_kernel_array(HOME), []
    for n in range(4500):
        slopes(pose, made.cables, full, slope)
        state, _ = made.step(state, first if n < 900 else second, (full - made.zeros) / 0.01)
        speeds.append(state.twist[:3])
        pose = as_kernel_array(se3.compose(pose[:3, :3], pose[:3, 3] + made.period * speeds[-1]))
    assert np.linalg.norm(np.diff(speeds, axis=0), axis=1).max() < 0.5e-3 + 1e-9
    assert np.linalg.norm(pose[:3, 3] - second[:3, 3]) < 1e-5


def test_it_stands_until_it_is_off_by_more_than_it_goes_for():
    made, state = ready(stop=1e-4, go=1e-3)
    for shift, moves in ((5e-4, False), (2e-3, True)):
        new, _ = made.step(state, se3.displace(HOME, [shift, 0, 0], np.zeros(3)), np.zeros(8))
        assert new.arrived is not moves


def test_a_step_changes_nothing_that_it_was_given():
    made, state = ready()
    before = [state.memory.copy(), state.now.copy(), state.drum.copy(), *(np.copy(a) for a in made.arrays)]
    one, command = made.step(state, se3.displace(HOME, [0.1, 0, 0], np.zeros(3)), np.zeros(8))
    two, again = made.step(state, se3.displace(HOME, [0.1, 0, 0], np.zeros(3)), np.zeros(8))
    assert all(
        np.array_equal(a, b) for a, b in zip(before, [state.memory, state.now, state.drum, *made.arrays], strict=True)
    )
    assert np.array_equal(one.memory, two.memory) and np.array_equal(command.torque, again.torque)


def test_torques_are_those_of_the_tensions_where_it_stands():
    machine = robot()
    ready = Prepared(machine, method="mid")
    made, state = platform_controller(ready, Drums.of(0.04, 4.0)).power_up(HOME, np.linspace(-3, 3, 8))
    _, command = made.step(state, HOME, np.linspace(-3, 3, 8))
    assert np.abs(command.torque - 0.01 * ready.tension(as_kernel_array(HOME)).tension).max() < 1e-9
    assert not command.brake


def test_what_makes_no_sense_is_refused():
    made, state = ready()
    with pytest.raises(ModelError, match="another shape"):
        made.step(state, HOME, np.zeros(7))
    with pytest.raises(ModelError, match="unknown rotation"):
        MotionLimits(rotation="euler")
    with pytest.raises(ModelError, match="no hysteresis"):
        MotionLimits(stop=1e-3, go=1e-4)
    with pytest.raises(ModelError, match="not above zero"):
        SafeLimits(patience=0.0)
    with pytest.raises(ModelError, match="no tensions within the limits"):
        platform_controller(Prepared(robot(), method="mid"), Drums.of(0.04)).power_up(
            se3.displace(HOME, [5.0, 0, 0], np.zeros(3)), np.zeros(8)
        )
