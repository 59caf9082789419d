"""Platforms start where they stood, though nobody knows where the instrument stands or what the cables count from."""

from __future__ import annotations

import numpy as np
import pytest
from cables.cable_robots import box

from robocal.cables.geometry import lengths
from robocal.fit.starts.own import place_configurations
from robocal.fit.starts.unknown_zeros import begin_zeros
from robocal.geometry import fits, se3
from robocal.measure.data import Configurations, DataSet, Frame, Observations


def log(robot, rng, owner, m=30):
    """Poses of the platform (m, 4, 4), and what sensors and an instrument anywhere showed of them."""
    middle, size = robot.a.mean(axis=0), np.ptp(robot.a, axis=0)
    vector = np.concatenate([middle + rng.uniform(-0.25, 0.25, (m, 3)) * size, rng.normal(0, 0.1, (m, 3))], axis=1)
    pose = se3.from_vector(vector)
    anchors = robot.numbers[:, :6] + np.concatenate([rng.normal(0, 0.01, (8, 3)), np.zeros((8, 3))], axis=1)
    read = [lengths(pose[None], np.append(a, 0.0)[None], robot.pulley(i))[0][0] for i, a in enumerate(anchors)]
    shown = np.stack(read, axis=1) - rng.uniform(-5, 5, 8) + rng.normal(0, 5e-4, (m, 8))
    frame = se3.from_vector(np.concatenate([rng.uniform(-9, 9, 3), rng.normal(0, 1.5, 3)]))
    options = {"cables": robot.cables} | ({"zeros": "power"} if owner else {})
    cable = {"cable": np.tile(np.arange(8.0), m)}
    drawn = Observations("lengths", np.repeat(np.arange(m), 8), shown.reshape(-1, 1), extra=cable, options=options)
    free = Frame("tracker", (0.0,) * 6, (True,) * 6)
    seen = Observations("pose", np.arange(m), se3.to_vector(frame @ pose), frame=free)
    return pose, DataSet(Configurations(tuple(f"p{i}" for i in range(m))), (drawn, seen))


@pytest.mark.parametrize("owner", [True, False])
@pytest.mark.parametrize("seed", range(6))
def test_poses_start_where_they_were(seed, owner):
    robot = box()
    pose, data = log(robot, np.random.default_rng(seed), owner)
    start = se3.from_vector(place_configurations(robot, data).configurations.start)
    away = np.linalg.norm(start[:, :3, 3] - pose[:, :3, 3], axis=1)
    # The whole may be shifted by what the anchors are off: no more than a tenth of the machine.
    assert away.max() < 0.1 * np.ptp(robot.a, axis=0).max()
    home = fits.rigid(start[:, :3, 3], pose[:, :3, 3])
    assert np.abs(home[:3, :3] - np.eye(3)).max() < 0.1


def test_a_start_that_is_given_stays():
    robot = box()
    pose, data = log(robot, np.random.default_rng(3), True)
    given = se3.to_vector(pose) + 0.5
    data = DataSet(Configurations(data.configurations.ids, start=given), data.observations)
    assert np.array_equal(place_configurations(robot, data).configurations.start, given)


@pytest.mark.parametrize("seed", range(3))
def test_zeros_of_the_robot_begin_where_its_platform_stood(seed):
    """Where nobody has said them; where they are right, nothing begins elsewhere."""
    robot = box()
    robot = robot.with_table(robot.table.with_values({f"c{i}.l0": 0.0 for i in range(1, 9)}))
    freed = robot.with_table(robot.table.with_free([f"c{i}.l0" for i in range(1, 9)]))
    data = place_configurations(freed, log(robot, np.random.default_rng(seed), False)[1])
    begun = begin_zeros(freed, data)
    assert set(begun) == {f"c{i}.l0" for i in range(1, 9)}
    there = freed.with_table(freed.table.with_values(begun))
    assert begin_zeros(there, data) == {}  # somebody has said them
    assert begin_zeros(robot, data) == {}  # none is free
