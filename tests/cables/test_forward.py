"""Forward kinematics: poses from lengths, near, far and anywhere; covariance; solutions that are not unique."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cables.cable_robots import PUBLISHED, box, directions, poses, published

from robocal.cables.forward import forward
from robocal.cables.geometry import cable_robot
from robocal.cables.inverse import inverse
from robocal.errors import ModelError
from robocal.geometry import se3, so3


def off(found, truth):
    """Distance in m and angle in rad."""
    turn = so3.log(found[:, :3, :3] @ truth[:, :3, :3].swapaxes(1, 2))
    return np.linalg.norm(found[:, :3, 3] - truth[:, :3, 3], axis=1), np.linalg.norm(turn, axis=1)


def away(pose, rng, angle, distance):
    k = len(pose)
    return se3.compose(
        so3.exp(directions(rng, k, angle)) @ pose[:, :3, :3], pose[:, :3, 3] + directions(rng, k, distance)
    )


@pytest.mark.parametrize("name", PUBLISHED)
def test_recovers_the_pose(name, rng):
    """From 15 degrees and 0.3 m away, one start each: 95 %; from hopeless starts, with others beside them: always."""
    robot = published(name)
    pose = poses(robot, rng, 200)
    measured, _ = inverse(robot, pose)
    found = forward(robot, measured, away(pose, rng, np.radians(15), 0.3))
    near, turned = off(found.pose, pose)
    assert ((near < 1e-9) & (turned < 1e-9)).mean() >= 0.95
    assert (found.solutions == 0).all()
    many = forward(robot, measured[:60], away(pose[:60], rng, np.pi, 2.0), starts=24, rng=rng)
    near, turned = off(many.pose, pose[:60])
    assert near.max() < 1e-9 and turned.max() < 1e-9
    alone = forward(robot, measured)  # nobody says where
    assert (off(alone.pose, pose)[0] < 1e-9).mean() >= 0.95
    assert many.converged.all() and (many.solutions == 1).all() and np.isnan(many.rival).all()


def test_a_single_hopeless_start_can_end_in_a_local_minimum(rng):
    """So that the test above could fail: the same starts alone do not always arrive."""
    robot = box()
    pose = poses(robot, rng, 100)
    found = forward(robot, inverse(robot, pose)[0], away(pose, rng, np.pi, 2.0))
    assert 0 < (off(found.pose, pose)[0] > 1e-3).mean() < 1


@pytest.mark.parametrize("model", ["pulleys", "stretch", "stretch over pulleys", "sag", "sag over pulleys"])
def test_every_length_model(model, rng):
    from cables.test_lengths import MODELS

    change, tension, sags = MODELS[model]
    robot = change(box(), rng)
    pose = poses(robot, rng, 20)
    measured, _ = inverse(robot, pose, tension, sag=sags)
    found = forward(robot, measured, away(pose, rng, np.radians(15), 0.3), tension=tension, sag=sags)
    near, turned = off(found.pose, pose)
    assert near.max() < 1e-9 and turned.max() < 1e-9
    wrong, _ = off(forward(box(), measured, pose).pose, pose)
    assert wrong.max() > 1e-5  # a robot without it would be wrong


def test_covariance_is_the_scatter(rng):
    """Errors of 3000 noisy solutions, whitened by the covariance, have mean square 6; and without a stated noise the
    residuals give its size."""
    robot = box()
    pose = np.broadcast_to(poses(robot, rng, 1), (3000, 4, 4))
    measured = inverse(robot, pose)[0] + 1e-3 * rng.normal(size=(3000, 8))
    found = forward(robot, measured, pose, sigma=1e-3)
    error = np.concatenate(
        [found.pose[:, :3, 3] - pose[:, :3, 3], so3.log(found.pose[:, :3, :3] @ pose[:, :3, :3].swapaxes(1, 2))], axis=1
    )
    whitened = np.einsum("ki,kij,kj->k", error, np.linalg.inv(found.covariance), error)
    assert whitened.mean() == pytest.approx(6, abs=5 * np.sqrt(12 / 3000))
    guessed = forward(robot, measured, pose)
    ratio = np.einsum("kii->k", guessed.covariance) / np.einsum("kii->k", found.covariance)
    assert ratio.mean() == pytest.approx(1, abs=5 * 1 / np.sqrt(3000))  # chi-squared of two degrees over two


def test_two_poses_with_the_same_lengths_are_both_told(rng):
    """All anchors in a plane, a flat platform: its mirror image above the frame has the same lengths."""
    robot = box()
    a, b = robot.a.copy(), robot.b.copy()
    a[:, 2], b[:, 2] = 3.0, 0.0
    a[:4, :2] *= 0.8
    flat = cable_robot("flat", a, b)
    pose = se3.from_vector(np.array([[0.3, -0.2, 1.2, 0.1, 0.05, 0.2]]))
    found = forward(flat, inverse(flat, pose)[0], pose, starts=40, rng=rng)
    assert found.solutions[0] == 2
    np.testing.assert_allclose(found.pose, pose, atol=1e-9)  # the caller's start is kept
    np.testing.assert_allclose(se3.to_vector(found.rival), [[0.3, -0.2, 4.8, -0.1, -0.05, 0.2]], atol=1e-6)

    # Nobody says where to begin: the platform hangs, and does not stand on its cables. One start is enough for that.
    for starts in (0, 40):
        np.testing.assert_allclose(forward(flat, inverse(flat, pose)[0], starts=starts).pose, pose, atol=1e-9)


@pytest.mark.parametrize(
    ("degrees", "plane"), [("2T", "xz"), ("2T", "xy"), ("1R2T", "xz"), ("1R2T", "xy"), ("1R2T", "yz")]
)
def test_planar_robots_stay_in_their_plane(degrees, plane, rng):
    one, up = ("xyz".index(letter) for letter in plane)
    flat = np.array([[-2, 0], [2, 0], [2, 3], [-2, 3.0]])
    a, b = np.zeros((4, 3)), np.zeros((4, 3))
    a[:, [one, up]] = flat
    if degrees == "1R2T":
        b[:, [one, up]] = [[-0.2, 0.1], [0.2, 0.1], [0.2, -0.1], [-0.2, -0.1]]
    robot = replace(cable_robot("plane", a, b), degrees=degrees, plane=plane)
    twist = np.zeros((30, 6))
    twist[:, robot.axes] = rng.uniform(-0.3, 0.3, (30, len(robot.axes)))
    pose = se3.from_vector(twist)
    pose[:, :3, 3] += robot.home[:3, 3]
    found = forward(robot, inverse(robot, pose)[0], starts=4, rng=rng)
    np.testing.assert_allclose(found.pose, pose, atol=1e-9)
    assert found.covariance.shape == (30, len(robot.axes), len(robot.axes))


def test_what_cannot_be_solved_is_said():
    robot = box()
    with pytest.raises(ModelError, match="wrong number of cable lengths; found 7"):
        forward(robot, np.ones(7))
    with pytest.raises(ModelError, match="c2: a length is not a number"):
        forward(robot, [1, np.nan, 1, 1, 1, 1, 1, 1])
    with pytest.raises(ModelError, match="so few lengths"):
        forward(cable_robot("three", robot.a[:3], robot.b[:3]), np.ones(3))
