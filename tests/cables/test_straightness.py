"""Sag, excess length and stretch: the seed's numbers, and the catenary and forward kinematics that they must agree with."""

from __future__ import annotations

import numpy as np
import pytest
from cables.cable_robots import box, poses

from robocal.cables.cable_lengths import inverse
from robocal.cables.elastic import catenary, hang_by_tension
from robocal.cables.forward import forward
from robocal.cables.rope import rope, strain, strain_slopes
from robocal.cables.straightness import (
    excess_of,
    greatest_tension,
    least_tension,
    level_excess,
    level_sag,
    pose_change,
    position_gain,
    sag_of,
    sag_slope,
    where_it_decides,
    worst_position,
)

TENSION = np.array([4.6, 10.4, 14.5, 18.6])


def test_the_level_cable_of_the_thesis():
    np.testing.assert_allclose(1e3 * level_sag(4.925, TENSION, 0.122), [80.44, 35.57, 25.51, 19.89], rtol=1e-3)
    np.testing.assert_allclose(1e3 * level_excess(4.925, TENSION, 0.122), [3.502, 0.685, 0.352, 0.214], rtol=2e-3)
    assert 1e3 * 4.925 * strain(100.0, 2.5e-5) == pytest.approx(12.31, rel=1e-3)


def test_a_light_cable_loses_no_digits():
    t = 50.0
    for w in (1e-9, 0.0398, 0.0407, 0.1):  # about where the series ends
        assert level_sag(1.0, t, w) == pytest.approx(w / (8 * t) * (1 + (w / (2 * t)) ** 2 / 12), rel=1e-12)
        assert sag_slope(1.0, t, w) == pytest.approx(
            (level_sag(1.0, t, w + 1e-4) - level_sag(1.0, t, w - 1e-4)) / 2e-4, rel=1e-6
        )


@pytest.fixture
def hung(rng):
    robot = box()
    pose = poses(robot, rng, 6)
    return robot, pose, rng.uniform(5, 60, (6, 8)), np.full(8, 0.122)


def test_the_excess_is_what_sagging_lengths_are_longer_by(hung):
    robot, pose, tension, weight = hung
    stiff = robot.having(elasticity=None, density=weight)
    longer = inverse(stiff, pose, tension, sag=True)[0] - inverse(stiff, pose)[0]
    np.testing.assert_allclose(sag_of(robot, pose, tension, weight)[1], longer, atol=1e-12)


def test_an_inclined_cable_hangs_as_far_as_the_furthest_of_its_points(hung):
    robot, pose, tension, weight = hung
    sag = sag_of(robot, pose, tension, weight)[0]
    d = pose[:, None, :3, 3] + robot.b @ pose[:, :3, :3].swapaxes(-1, -2) - robot.a
    ends = np.array([np.hypot(d[2, 3, 0], d[2, 3, 1]), d[2, 3, 2]])
    found = hang_by_tension(ends, tension[2, 3], weight[3], 0.0)
    force, length = found.force, float(found.length)
    s = np.linspace(0, length, 4001)
    below = force - np.stack([0 * s, weight[3] * (length - s)], axis=-1)
    at, _ = catenary(below, s, weight[3], 0.0)
    far = np.abs(ends[0] * at[:, 1] - ends[1] * at[:, 0]) / np.linalg.norm(ends)
    assert sag[2, 3] == pytest.approx(far.max(), rel=1e-5)


def test_a_pose_changes_as_forward_kinematics_say(hung):
    robot, pose, tension, weight = hung
    longer = sag_of(robot, pose, tension, weight)[1] / 100  # to first order
    straight = robot.having(elasticity=None)
    found = forward(straight, inverse(straight, pose)[0] + longer).pose
    twist = pose_change(robot, pose, longer)
    np.testing.assert_allclose(found[:, :3, 3] - pose[:, :3, 3], twist[:, :3], atol=5e-9)
    assert np.abs(twist[:, :3]).max() > 1e-6
    worst = worst_position(position_gain(robot, pose), longer)
    some = np.random.default_rng(1).uniform(0, 1, (200, 6, 8)) * longer
    moved = np.array([np.linalg.norm(pose_change(robot, pose, s)[:, :3], axis=1) for s in some])
    assert (moved <= worst + 1e-12).all() and (worst >= np.linalg.norm(twist[:, :3], axis=1)).all()


def test_the_least_tension_leaves_what_is_wanted_and_a_little_less_does_not():
    t = least_tension(lambda t: float(level_excess(4.925, t, 0.122)), 2e-4, 1.0)
    assert level_excess(4.925, t, 0.122) <= 2e-4 < level_excess(4.925, t * (1 - 1e-5), 0.122)
    assert 18 < t < 20  # 3.7.2 holds 20 N for it
    most = greatest_tension(lambda t: 4.925 * float(strain(t, 2.5e-5)), 12.31e-3)
    assert most == pytest.approx(99.98, rel=1e-3)
    assert greatest_tension(lambda t: 0.0, 1e-3) is None


def test_a_cable_that_nothing_carries_is_no_number(hung):
    robot, pose, tension, weight = hung
    sag, longer = sag_of(robot, pose, 0 * tension + 1e-3, 1e3 * weight)
    assert np.isnan(sag).all() and np.isnan(longer).all()


def test_a_stiffening_rope_and_its_slopes():
    t = np.array([5.0, 50.0, 130.0])
    np.testing.assert_allclose(rope(elasticity=2e-5, exponent=0.7, reference=50.0).strain(50.0), 2e-5 * 50)
    by_e, by_p = strain_slopes(t, np.array(2e-5), np.array(0.7), 50.0)
    for h, told, moved in ((1e-9, by_e, (1e-9, 0)), (1e-6, by_p, (0, 1e-6))):
        up, down = (strain(t, 2e-5 + s * moved[0], 0.7 + s * moved[1], 50.0) for s in (1, -1))
        np.testing.assert_allclose(told, (up - down) / (2 * h), rtol=1e-5, atol=1e-12)


def test_of_many_poses_the_worst_ones_decide(rng):
    robot, weight = box(), np.full(8, 0.122)
    pose = poses(robot, rng, 300)
    gain, asked = position_gain(robot, pose), []

    def error(tension, at):
        asked.append(len(at))
        return worst_position(gain[at], excess_of(robot, pose[at], np.full((len(at), 8), tension), weight))

    def search(error):
        return least_tension(error, 2e-4, 1.0)

    def of_all(t):
        return float(error(t, np.arange(300)).max())

    found = where_it_decides(error, 300, search, 2e-4)
    assert sum(n == 300 for n in asked) <= 5  # every pose is looked at few times, however many there are
    assert found == pytest.approx(search(of_all), rel=2e-6) and of_all(found) <= 2e-4 < of_all(found * (1 - 1e-5))
