"""Frame anchors and zeros of cables from measured poses: exactness without a guess, what a list cannot tell, and stretch."""

from __future__ import annotations

import numpy as np
import pytest
from cables.cable_robots import PUBLISHED, directions, poses, published

from robocal.cables.cable_lengths import inverse
from robocal.cables.calibration.per_cable import flat, per_cable
from robocal.cables.geometry import CableRobot, cable_robot
from robocal.cables.pulley import Pulleys
from robocal.errors import ModelError
from robocal.geometry import se3, so3

EXACT = 1e-9  # m


def made(seed: int, cables: int, degrees: str = "3R3T") -> CableRobot:
    """A random robot in a frame of about 5 x 4 x 3 m."""
    rng = np.random.default_rng(seed)
    a = rng.uniform([-2.5, -2, 0], [2.5, 2, 3], (cables, 3))
    b = rng.uniform(-0.3, 0.3, (cables, 3))
    if degrees in ("1R2T", "2T"):
        a[:, 1], b[:, 1] = 0.4, 0.1
    return cable_robot("random", a, b, rng.uniform(0.5, 2.0, cables), degrees=degrees)


def listed(robot: CableRobot, rng: np.random.Generator, n: int) -> np.ndarray:
    """Poses that the robot can have, in its own plane if it has one."""
    out = poses(robot, rng, n)
    if len(robot.axes) < 6:
        vector = np.zeros((n, 6))
        vector[:, list(robot.axes)] = se3.to_vector(out)[:, list(robot.axes)]
        out = se3.from_vector(vector)
    return out


def attached(robot: CableRobot, t: np.ndarray) -> np.ndarray:
    """Where the platform anchors are, (n, m, 3)."""
    return t[:, None, :3, 3] + np.einsum("nij,mj->nmi", t[:, :3, :3], robot.b)


def read(robot: CableRobot, t: np.ndarray) -> np.ndarray:
    """What sensors without noise show, by a formula of its own."""
    return np.linalg.norm(attached(robot, t) - robot.a, axis=2) - robot.zeros


def blank(robot: CableRobot) -> CableRobot:
    """The same robot, of which nobody knows frame anchors and zeros; a planar one's plane is known."""
    a = np.zeros_like(robot.a)
    if robot.planar:
        a[:, 1] = robot.a[:, 1]
    return cable_robot("blank", a, robot.b, degrees=robot.degrees, plane=robot.plane)


ROBOTS = [*PUBLISHED, "six", "eight", "twelve", "1R2T", "2T", "3T"]


def robot_of(name: str, seed: int) -> CableRobot:
    if name in PUBLISHED:
        return published(name)
    if name.endswith("T"):
        return made(seed, 4, name)
    return made(seed, {"six": 6, "eight": 8, "twelve": 12}[name])


@pytest.mark.parametrize("name", ROBOTS)
def test_as_many_poses_as_unknowns_need_no_guess(name):
    for seed in range(20):
        rng = np.random.default_rng(seed)
        robot = robot_of(name, seed)
        t = listed(robot, rng, 4 if robot.planar else 5)
        found = per_cable(blank(robot), t, read(robot, t))
        assert found.converged.all()
        assert np.abs(found.anchors[0] - robot.a).max() < EXACT and np.abs(found.zeros[0] - robot.zeros).max() < EXACT


def test_lists_that_stay_in_a_plane_a_line_or_a_place_are_refused_by_name():
    robot = made(0, 8)
    rng = np.random.default_rng(0)
    shift = rng.uniform(-0.5, 0.5, (12, 3))
    for keep, what in (((1, 1, 0), "a plane"), ((1, 0, 0), "a line"), ((0, 0, 0), "one point")):
        t = se3.compose(np.broadcast_to(so3.exp([0.1, 0.2, 0.3]), (12, 3, 3)), shift * keep + [0, 0, 1.5])
        assert flat(attached(robot, t)[:, 0]) == what
        with pytest.raises(ModelError, match=f"c1 stays in {what}"):
            per_cable(robot, t, read(robot, t))


def test_too_few_poses_and_other_shapes_are_refused():
    robot = made(0, 8)
    t = poses(robot, np.random.default_rng(0), 8)
    y = read(robot, t)
    with pytest.raises(ModelError, match="too few poses"):
        per_cable(robot, t[:4], y[:4])
    with pytest.raises(ModelError, match="belong together"):
        per_cable(robot, t, y[:, :7])
    with pytest.raises(ModelError, match="unknown residual"):
        per_cable(robot, t, y, residual="cubed")
    gone = y.copy()
    gone[:4, 2] = np.nan
    with pytest.raises(ModelError, match="c3|too few"):
        per_cable(robot, t, gone)


def test_readings_that_lack_do_not_count():
    robot = made(1, 8)
    rng = np.random.default_rng(1)
    t = poses(robot, rng, 30)
    y = read(robot, t)
    y[rng.random(y.shape) < 0.3] = np.nan
    found = per_cable(blank(robot), t, y)
    assert np.abs(found.anchors[0] - robot.a).max() < EXACT
    assert (found.numbers[0] == np.isfinite(y).sum(axis=0)).all()


def test_stretch_is_taken_off():
    robot = made(2, 8)
    rng = np.random.default_rng(2)
    t, e = poses(robot, rng, 30), np.full(8, 2.5e-5)
    tension = rng.uniform(20, 125, (30, 8))
    y = (read(robot, t) + robot.zeros) / (1 + e * tension) - robot.zeros
    nobody = cable_robot("blank", np.zeros((8, 3)), robot.b, elasticity=e)
    found = per_cable(nobody, t, y, tensions=tension)
    assert np.abs(found.anchors[0] - robot.a).max() < EXACT and np.abs(found.zeros[0] - robot.zeros).max() < EXACT
    without = per_cable(nobody, t, y)
    assert np.abs(without.anchors[0] - robot.a).max() > 1e-4


@pytest.mark.parametrize("poses_of", [5, 40])
@pytest.mark.parametrize("cables", [6, 8, 12])
def test_over_pulleys_the_same_without_a_guess(cables, poses_of):
    """And under tensions, by which these cables stretch too."""
    robot = made(4, cables)
    rng = np.random.default_rng(cables)
    axis = rng.normal(size=(cables, 3)) * 0.2 + [0, 0, 1]
    robot = robot.having(pulleys=Pulleys(rng.uniform(0.02, 0.08, cables), axis / np.linalg.norm(axis, axis=1, keepdims=True)),
        elasticity=np.full(cables, 2.5e-5),
    )  # fmt: skip
    t, tension = poses(robot, rng, poses_of), rng.uniform(20, 125, (poses_of, cables))
    y, _ = inverse(robot, t, tension=tension)
    nobody = blank(robot).having(pulleys=robot.pulleys, elasticity=robot.elasticity)
    found = per_cable(nobody, t, y, tensions=tension)
    assert found.converged.all()
    assert np.abs(found.anchors[0] - robot.a).max() < EXACT and np.abs(found.zeros[0] - robot.zeros).max() < EXACT
    straight = per_cable(blank(robot), t, y)
    assert np.abs(straight.anchors[0] - robot.a).max() > 1e-3
    with pytest.raises(ModelError, match="straight"):
        per_cable(nobody, t, y, residual="squared")


def test_lists_at_once_are_lists_one_by_one():
    robot = made(3, 8)
    rng = np.random.default_rng(3)
    t = np.stack([poses(robot, rng, 25) for _ in range(4)])
    y = np.stack([read(robot, one) for one in t]) + 1e-3 * rng.normal(size=(4, 25, 8))
    together = per_cable(robot, t, y)
    for i in range(4):
        alone = per_cable(robot, t[i], y[i])
        assert np.array_equal(alone.anchors[0], together.anchors[i]) and np.array_equal(
            alone.zeros[0], together.zeros[i]
        )


def test_a_start_far_off_ends_where_none_does():
    robot = made(4, 8)
    rng = np.random.default_rng(4)
    t = poses(robot, rng, 40)
    y = read(robot, t) + 2e-3 * rng.normal(size=(40, 8))
    first = per_cable(blank(robot), t, y)
    start = np.column_stack([robot.a + 0.1 * directions(rng, 8, 1.0), robot.zeros + 0.1])
    second = per_cable(robot, t, y, start=start)
    assert np.abs(first.anchors - second.anchors).max() < 1e-8 and (second.iterations > 0).all()
