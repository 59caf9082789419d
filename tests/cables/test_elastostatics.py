"""Tensions and lengths together: how far sag and stretch move lengths, poses and forces on the Laval robot."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.cables.cable_lengths import inverse
from robocal.cables.forward import forward
from robocal.cables.geometry import straight
from robocal.cables.hanging import hang
from robocal.cables.pose_list import default_box
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import distribute
from robocal.files.cable.cable_robot import read_cable
from robocal.geometry import se3, so3


@pytest.fixture
def held(shared_data, rng):
    """The robot, poses of its box up to 15 degrees off that tensions of 20 to 125 N hold, the tensions, the weights."""
    robot = read_cable(shared_data / "cable-robots" / "laval.yaml").robot
    turn = rng.normal(size=(4000, 3))
    turn *= np.radians(15) * rng.uniform(size=(4000, 1)) / np.linalg.norm(turn, axis=1, keepdims=True)
    at = robot.home[:3, 3] + rng.uniform(-1, 1, (4000, 3)) * default_box(robot.a).translation
    pose = se3.compose(so3.exp(turn), at)
    load = gravity_wrench(pose, robot.mass, robot.com)
    found = distribute(structure_of(robot, pose, strict=False), load, robot.limits)
    return robot, pose[found.feasible], found.tension[found.feasible], load[found.feasible]


def test_what_neglected_stretch_and_sag_are_worth(held):
    """The numbers of docs/cable-robots.md, in mm: medians and worst of some hundred poses."""
    robot, pose, tension, _ = held
    assert len(pose) > 300
    full, _, _ = straight(robot, pose)
    stretched, _ = inverse(robot, pose, tension)
    sagging, _ = inverse(robot, pose, tension, sag=True)
    by_stretch, by_sag = full - robot.zeros - stretched, sagging - stretched
    assert 1e3 * np.median(by_stretch) == pytest.approx(2.4, rel=0.1) and 9 < 1e3 * by_stretch.max() < 11
    assert 1e3 * np.median(by_sag) == pytest.approx(0.008, abs=0.003) and 0.1 < 1e3 * by_sag.max() < 0.15

    def off(lengths, **more):
        found = forward(robot, lengths, pose, **more).pose
        return 1e3 * np.linalg.norm(found[:, :3, 3] - pose[:, :3, 3], axis=1)

    assert np.median(off(sagging)) == pytest.approx(2.6, rel=0.1)
    assert np.median(off(sagging, tension=tension)) == pytest.approx(0.04, abs=0.015)
    assert off(sagging, tension=tension).max() < 0.15
    assert off(sagging, tension=tension, sag=True).max() < 1e-6


def test_sagging_cables_pull_lower_than_straight_ones(held):
    """At the same tensions each pulls lower by w l cos^2 / 2 of its weight to first order, so that about 1.1 N of the
    platform's 49 N is not balanced."""
    robot, pose, tension, load = held
    lever = robot.b @ pose[:, :3, :3].swapaxes(1, 2)
    d = pose[:, None, :3, 3] + lever - robot.a
    hung = hang(d, tension, robot.density, robot.elasticity)
    np.testing.assert_allclose(np.linalg.norm(hung.force, axis=-1), tension, rtol=1e-12)
    full = np.linalg.norm(d, axis=-1)
    across = np.hypot(d[..., 0], d[..., 1]) / full
    left = load[:, :3] - hung.force.sum(axis=1)
    lost = (robot.density * full * across**2 / 2).sum(axis=1)
    np.testing.assert_allclose(left[:, 2], -lost, rtol=0.01)
    assert lost.mean() == pytest.approx(1.1, rel=0.05)
    turned = np.degrees(np.arccos(np.clip((hung.force * d).sum(axis=-1) / tension / full, -1, 1)))
    assert turned.max() == pytest.approx(0.77, abs=0.1) and np.median(turned) < 0.3
