"""Lengths in each other's columns, found by what the platform anchors alone say."""

from __future__ import annotations

import numpy as np
import pytest
from cables.cable_robots import box, poses, published
from cables.test_calibration import read

from robocal.cables.geometry import cable_robot
from robocal.diagnose.cables.columns import find_exchange
from robocal.geometry import se3

NOISE, TILT = 3e-3, np.radians(15)


def seen(robot, seed, n=60, tilt=TILT):
    rng = np.random.default_rng(seed)
    t = poses(robot, rng, n, tilt)
    return t, read(robot, t) + NOISE * rng.normal(size=(n, len(robot.cables)))


@pytest.mark.parametrize("order", [(0, 1, 5, 3, 4, 2, 6, 7), (1, 0, 2, 3, 4, 5, 7, 6), (1, 2, 0, 3, 4, 5, 6, 7)])
@pytest.mark.parametrize("robot", [box(), None], ids=["box", "laval"])
def test_columns_in_each_others_place_are_found(robot, order):
    robot = robot or published("laval")
    t, y = seen(robot, 0)
    # Wherever the instrument is, and with frame anchors and zeros that are decimetres off.
    rng = np.random.default_rng(1)
    off = cable_robot("off", robot.a + 0.1 * rng.normal(size=robot.a.shape), robot.b, robot.zeros + 1.0)
    found = find_exchange(off, se3.from_vector([3.0, -1.0, 0.5, 0.3, 2.0, -1.0]) @ t, y[:, list(order)])
    assert found is not None and found.of == order and not found.anchors
    assert found.left < 2 * NOISE and found.stated > 3 * found.left
    assert found.wrong_columns == tuple(i for i in range(8) if order[i] != i)


def test_platform_anchors_in_each_others_place_are_told_apart():
    robot = published("laval")
    t, y = seen(robot, 2)
    order = [0, 1, 5, 3, 4, 2, 6, 7]
    found = find_exchange(cable_robot("file", robot.a, robot.b[order], robot.zeros), t, y)
    assert found is not None and found.of == tuple(order) and found.anchors


@pytest.mark.parametrize("seed", range(10))
def test_what_is_in_its_place_stays(seed):
    robot = published("laval")
    assert find_exchange(robot, *seen(robot, seed)) is None


def test_nothing_is_said_of_what_cannot_tell():
    robot = published("laval")
    swap = [0, 1, 5, 3, 4, 2, 6, 7]
    t, y = seen(robot, 3)
    assert find_exchange(robot, t[:8], y[:8, swap]) is None
    # A platform that does not turn carries all its anchors alike.
    t, y = seen(robot, 4, tilt=1e-9)
    assert find_exchange(robot, t, y[:, swap]) is None
    t = np.repeat(t[:1], 30, axis=0)
    assert find_exchange(robot, t, read(robot, t)[:, swap]) is None
