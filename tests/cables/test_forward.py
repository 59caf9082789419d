"""Forward kinematics: poses from lengths, near, far and anywhere; covariance; solutions that are not unique."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cables.cable_robots import PUBLISHED, box, directions, poses, published
from cables.test_lengths import MODELS
from scipy.stats import chi2

from robocal.cables.cable_lengths import inverse
from robocal.cables.forward import forward
from robocal.cables.geometry import cable_robot
from robocal.cables.pulley import Pulleys
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


TENSIONS = {"ipanema_1": 300.0, "ipanema_2": 1000.0, "ipanema_3": 1000.0, "cogiro": 2000.0, "laval": 60.0, "box": 60.0}


@pytest.mark.sampled(5)
@pytest.mark.parametrize("name", [*PUBLISHED, "box"])
@pytest.mark.parametrize("model", [model for model in MODELS if model != "straight"])
def test_every_length_model(model, name, rng):
    """As above with pulleys, stretch, sag and all together; a robot without them would be somewhere else."""
    plain = box() if name == "box" else published(name)
    change, tension, sags = MODELS[model]
    robot, pose = change(plain, rng), poses(plain, rng, 60)
    pull = None if tension is None else TENSIONS[name]
    measured, _ = inverse(robot, pose, pull, sag=sags)
    found = forward(robot, measured, away(pose, rng, np.radians(15), 0.3), tension=pull, sag=sags)
    near, turned = off(found.pose, pose)
    assert ((near < 1e-9) & (turned < 1e-9)).mean() >= 0.95
    few = slice(10)
    start = away(pose[few], rng, np.radians(15), 0.3)
    many = forward(robot, measured[few], start, tension=pull, sag=sags, starts=12, rng=rng)
    near, turned = off(many.pose, pose[few])
    assert near.max() < 1e-9 and turned.max() < 1e-9 and (many.solutions == 1).all()
    wrong, _ = off(forward(plain, measured, pose).pose, pose)
    assert wrong.max() > 1e-5


PLANAR = [("2T", "xz"), ("2T", "xy"), ("1R2T", "xz"), ("1R2T", "xy"), ("1R2T", "yz")]


def planar(degrees, plane, m, rng):
    """m cables around an ellipse, and pulleys whose swivel axes lie in the plane: cables over them stay in it."""
    one, up = ("xyz".index(letter) for letter in plane)
    angle = np.linspace(0.3, 0.3 + 2 * np.pi, m, endpoint=False) + rng.uniform(-0.2, 0.2, m)
    a, b, axis = np.zeros((m, 3)), np.zeros((m, 3)), np.zeros((m, 3))
    a[:, one], a[:, up], axis[:, up] = 2 * np.cos(angle), 1.5 * np.sin(angle), 1.0
    if degrees == "1R2T":
        b[:, one], b[:, up] = 0.25 * np.cos(3 * angle + 1), 0.15 * np.sin(2 * angle + 0.5)
    robot = replace(cable_robot("plane", a, b), degrees=degrees, plane=plane)
    return robot, Pulleys(rng.uniform(0.02, 0.08, m), axis)


@pytest.mark.sampled(4)
@pytest.mark.parametrize(("degrees", "plane"), PLANAR)
@pytest.mark.parametrize("model", list(MODELS))
def test_planar_robots_stay_in_their_plane(degrees, plane, model, rng):
    """Every model and plane, 4, 8 and 12 cables, from 0.3 m and 15 degrees away."""
    for m in (4, 8, 12):
        plain, wheel = planar(degrees, plane, m, rng)
        known = {"elasticity": np.linspace(1e-5, 4e-5, m), "density": np.linspace(0.05, 0.6, m)}
        robot = plain.having(**known, pulleys=wheel if "pulley" in model else None)
        axes, (_, pull, sags) = list(robot.axes), MODELS[model]
        twist, step = np.zeros((2, 40, 6))
        twist[:, axes] = rng.uniform(-0.25, 0.25, (40, len(axes)))
        angle = rng.uniform(-np.pi, np.pi, 40)
        step[:, axes[:2]] = 0.3 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        step[:, axes[2:]] = np.radians(15)
        pose = se3.from_vector(twist)
        pose[:, :3, 3] += robot.home[:3, 3]
        measured, _ = inverse(robot, pose, pull, sag=sags)
        found = forward(robot, measured, pose @ se3.from_vector(step), tension=pull, sag=sags)
        assert (np.abs(found.pose - pose).max(axis=(1, 2)) < 1e-9).mean() >= 0.95
        many = forward(robot, measured[:10], tension=pull, sag=sags, starts=12, rng=rng)
        np.testing.assert_allclose(many.pose, pose[:10], atol=1e-9)
        assert many.covariance.shape == (10, len(axes), len(axes)) and (many.solutions == 1).all()


@pytest.mark.sampled(3)
@pytest.mark.parametrize("m", range(6, 13))
def test_no_quiet_wrong_answer(m, rng):
    """Six cables have several poses for the same lengths, and which was meant nobody knows: then more than one are
    told. From seven cables on it is found."""
    wrong = []
    for _ in range(3):
        a, b = rng.uniform(-1, 1, (m, 3)), rng.uniform(-0.3, 0.3, (m, 3))
        robot = cable_robot("any", a / np.abs(a).max(axis=1, keepdims=True) * [2.5, 2, 1.5], b)
        turn = directions(rng, 40, rng.uniform(0, 0.26, 40))
        pose = se3.compose(so3.exp(turn), rng.uniform(-0.5, 0.5, (40, 3)))
        found = forward(robot, inverse(robot, pose)[0], starts=24, rng=rng)
        near, turned = off(found.pose, pose)
        lost = (near > 1e-7) | (turned > 1e-7)
        assert (found.solutions[lost] > 1).all()
        wrong.append(lost.mean())
    assert max(wrong) > 0 if m == 6 else max(wrong) == 0


@pytest.mark.slow
@pytest.mark.parametrize("case", ["spatial", "pulleys", "sag over pulleys", "1R2T", "2T", "1R2T over pulleys"])
def test_covariance_is_the_scatter(case, rng):
    """2000 noisy solutions: the sum of their chi-squares lies within the 99.9 % bounds, and so does that of every
    component; without a stated noise the residuals give its size."""
    n, sigma = 2000, 2e-4
    flat, model = case.split()[0] in ("1R2T", "2T"), case if case in MODELS else "straight"
    change, pull, sags = MODELS[model]
    if flat:
        plain, wheel = planar(case.split()[0], "xz", 5, rng)
        robot, one = plain.having(pulleys=wheel if "pulleys" in case else None), plain.home[None]
    else:
        robot, one = change(box(), rng), poses(box(), rng, 1)
    m, axes, pose = len(robot.cables), list(robot.axes), np.broadcast_to(one, (n, 4, 4))
    measured = inverse(robot, one, pull, sag=sags)[0] + sigma * rng.normal(size=(n, m))
    found = forward(robot, measured, pose, sigma=sigma, tension=pull, sag=sags)
    turn = so3.log(found.pose[:, :3, :3] @ pose[:, :3, :3].swapaxes(1, 2))
    error = np.concatenate([found.pose[:, :3, 3] - pose[:, :3, 3], turn], axis=1)[:, axes]
    whitened = np.einsum("ki,kij,kj->k", error, np.linalg.inv(found.covariance), error)
    single = error**2 / np.einsum("kii->ki", found.covariance)
    for total, freedom in ((whitened.sum(), n * len(axes)), *((part, n) for part in single.sum(axis=0))):
        low, high = chi2.ppf([0.0005, 0.9995], freedom)
        assert low < total < high
    guessed = forward(robot, measured, pose, tension=pull, sag=sags)
    ratio = np.einsum("kii->k", guessed.covariance) / np.einsum("kii->k", found.covariance)
    assert ratio.mean() == pytest.approx(
        1, abs=5 * np.sqrt(2 / (m - len(axes)) / n)
    )  # chi-squared of the spare over it


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


def test_what_cannot_be_solved_is_said():
    robot = box()
    with pytest.raises(ModelError, match="wrong number of cable lengths; found 7"):
        forward(robot, np.ones(7))
    with pytest.raises(ModelError, match="c2: a length is not a number"):
        forward(robot, [1, np.nan, 1, 1, 1, 1, 1, 1])
    with pytest.raises(ModelError, match="so few lengths"):
        forward(cable_robot("three", robot.a[:3], robot.b[:3]), np.ones(3))
