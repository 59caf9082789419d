"""Closed-form starts: exact without noise, near the truth with it, and silent where they know nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from twists import exp
from unit.arm_data import SIX, TRACKER, arm, measured, true_arm

from robocal.fit.starts.frames import hand_eye, point_start
from robocal.fit.starts.search import analytic_starts, refine
from robocal.geometry import se3, so3
from robocal.measure.base import problem
from robocal.measure.data import Frame
from robocal.prove.identify import baseline

FREE6 = (True,) * 6
T = se3.from_vector(TRACKER.value)
X = se3.from_vector([0.05, -0.1, 0.2, 2.0, -1.0, 0.7])


def poses(rng, m):
    return exp(rng.normal(scale=0.8, size=(m, 6)))


@pytest.mark.parametrize("m", [3, 4, 10, 60])
def test_hand_eye_is_exact_without_noise(rng, m):
    machine = poses(rng, m)
    t, x = hand_eye(T @ machine @ X, machine)
    np.testing.assert_allclose(t, T, atol=1e-10)
    np.testing.assert_allclose(x, X, atol=1e-10)


def test_hand_eye_is_near_with_noise(rng):
    machine = poses(rng, 40)
    noise = exp(1e-3 * rng.standard_normal((40, 6)))
    t, x = hand_eye(noise @ T @ machine @ X, machine)
    for found, truth in ((t, T), (x, X)):
        assert np.linalg.norm(found[:3, 3] - truth[:3, 3]) < 3e-3
        assert np.linalg.norm(so3.log(found[:3, :3] @ truth[:3, :3].T)) < 3e-3


def test_hand_eye_gives_rotations_even_from_nonsense(rng):
    for found in hand_eye(np.repeat(np.eye(4)[None], 3, axis=0), np.repeat(np.eye(4)[None], 3, axis=0)):
        np.testing.assert_allclose(found[:3, :3] @ found[:3, :3].T, np.eye(3), atol=1e-12)
        assert np.linalg.det(found[:3, :3]) == pytest.approx(1)


@pytest.mark.parametrize("m", [14, 60])
def test_point_start_is_exact_with_an_offset(rng, m):
    machine, c = poses(rng, m), np.array([0.1, -0.05, 0.3])
    points = (machine @ np.append(c, 1))[:, :3] @ T[:3, :3].T + T[:3, 3]
    t, found = point_start(points, machine)
    np.testing.assert_allclose(t, T, atol=1e-9)
    np.testing.assert_allclose(found, c, atol=1e-9)
    near, found = point_start(points + 1e-3 * rng.standard_normal(points.shape), machine)
    assert np.abs(found - c).max() < (0.05 if m == 14 else 5e-3) and np.abs(near - T).max() < 0.05


@pytest.mark.parametrize(("m", "offset"), [(3, True), (13, True), (60, False)])
def test_point_start_without_an_offset(rng, m, offset):
    machine = poses(rng, m)
    points = machine[:, :3, 3] @ T[:3, :3].T + T[:3, 3]
    t, c = point_start(points, machine, offset)
    np.testing.assert_allclose(t, T, atol=1e-10)
    assert not c.any()


def values(found, owner):
    return np.array([found[f"{owner}.{s}"] for s in SIX])


def test_position_start_of_an_arm(rng):
    robot, truth = arm(), true_arm(size=0.0)
    data = measured(30, truth=truth, noise=0)
    first, second = analytic_starts(robot, data, data.observations[0], np.arange(30))
    np.testing.assert_allclose(se3.from_vector(values(first, "tracker")), T, atol=1e-8)
    np.testing.assert_allclose(values(first, "tool"), [0.02, 0.01, 0.1, 0, 0, 0], atol=1e-8)
    assert "tool.x" not in second, "the other start trusts the tool"
    (only,) = analytic_starts(arm(free=("j2.alpha",)), data, data.observations[0], np.arange(30))
    assert set(only) == {f"tracker.{s}" for s in SIX}


@pytest.mark.parametrize("target", [None, Frame("ball", (0.05, 0.02, 0.1, 0.5, 0.2, -0.3), FREE6, "tool")])
def test_pose_start_of_an_arm(target):
    robot = arm()
    targets, index = ((target,), np.zeros(12, dtype=int)) if target else ((), None)
    data = measured(12, kind="pose", truth=robot, noise=0, targets=targets, target=index)
    first, second = analytic_starts(robot, data, data.observations[0], np.arange(12))
    np.testing.assert_allclose(se3.from_vector(values(first, "tracker")), T, atol=1e-8)
    wanted = target.value if target else (0.02, 0.01, 0.1, 0, 0, 0)
    np.testing.assert_allclose(
        se3.from_vector(values(first, "ball" if target else "tool")), se3.from_vector(wanted), atol=1e-8
    )
    if target is None:
        np.testing.assert_allclose(se3.from_vector(values(second, "tracker")), T, atol=1e-8)


def test_camera_in_hand_that_measures_poses():
    """The classical hand-eye problem: eye in hand, both the camera and the board unknown."""
    robot = arm()
    hand, board = (
        Frame("hand", (0.03, 0.01, 0.02, 2.0, -1.0, 0.8), FREE6, "tool"),
        Frame("board", (0.5, 0.1, -0.4, 2.0, 0.5, 0.2), FREE6),
    )
    data = measured(12, kind="pose", truth=robot, noise=0, frame=hand, targets=(board,), target=np.zeros(12, dtype=int))
    (found,) = analytic_starts(robot, data, data.observations[0], np.arange(12))
    np.testing.assert_allclose(se3.from_vector(values(found, "hand")), se3.from_vector(hand.value), atol=1e-8)
    np.testing.assert_allclose(se3.from_vector(values(found, "board")), se3.from_vector(board.value), atol=1e-8)


def test_the_most_frequent_target_starts_the_frame():
    robot = arm()
    near, far = (
        Frame("near", (0.0, 0, 0.05, 0, 0, 0), FREE6, "tool"),
        Frame("far", (0.1, 0.1, 0.2, 0, 0, 0), FREE6, "tool"),
    )
    index = np.array([0] * 5 + [1] * 25)
    data = measured(30, truth=robot, noise=0, targets=(near, far), target=index)
    first = analytic_starts(robot, data, data.observations[0], np.arange(30))[0]
    assert "far.x" in first and "near.x" not in first
    np.testing.assert_allclose(values(first, "far")[:3], far.value[:3], atol=1e-8)


def test_silence_where_nothing_is_known(rng):
    robot, data = arm(), measured(20)
    obs, units = data.observations[0], np.arange(20)

    def start(d=data, o=obs, u=units):
        return analytic_starts(robot, d, o, u)

    assert start(o=replace(obs, frame=None)) == [] and start(o=replace(obs, kind="lengths")) == []
    assert start(o=replace(obs, frame=replace(TRACKER, free=(False,) * 6))) == []
    assert start(d=replace(data, configurations=replace(data.configurations, joints=None))) == []
    assert start(u=units[:2]) == [], "two points turn about a line"
    assert (
        start(u=units[:0]) == []
        and start(o=replace(obs, targets=(TRACKER,), target=np.zeros(20, int)), u=units[:0]) == []
    )
    fixed = replace(obs, targets=(Frame("peg"),), target=np.zeros(20, dtype=int))
    assert start(o=fixed) == [], "a peg on the base says nothing of the arm"
    q = data.configurations.joints.copy()
    q[5:] = np.nan
    partly = replace(data, configurations=replace(data.configurations, joints=q))
    assert start(d=partly) and start(d=partly, u=np.array([0, 1, 9, 10])) == []


def test_refine_takes_the_cheapest_start_and_leaves_what_is_held(rng):
    robot, data = arm(), measured(30, noise=0, truth=arm())
    p = problem(robot, data)
    frames = tuple(f"tracker.{s}" for s in SIX)
    good = dict(zip(frames, TRACKER.value, strict=True))
    bad = dict(zip(frames, rng.normal(size=6), strict=True))
    x, converged = refine(p, frames, [bad, good])
    assert converged
    np.testing.assert_allclose(x[0, [p.table.index[n] for n in frames]], TRACKER.value, atol=1e-9)
    np.testing.assert_array_equal(refine(p, (), [good])[0], p.start)
    held, _ = refine(p, frames[:3], [{**good, "tracker.rx": 9.0}])
    assert held[0, p.table.index["tracker.rx"]] == 0.0
    nothing, _ = refine(p, frames, [dict.fromkeys(frames, np.nan)])
    assert np.isfinite(nothing).all(), "a start that is not a number loses"


@pytest.mark.parametrize("kind", ["position", "pose"])
def test_baseline_finds_the_instrument_anywhere(kind):
    """From a frame of which nothing is known, behind the robot and upside down."""
    away = replace(TRACKER, value=(-3.0, 1.0, -2.0, 3.0, 0.4, -0.5))
    robot, data = arm(), measured(20, kind=kind, frame=away, noise=0, truth=arm())
    _, x = baseline(robot, data, np.arange(20))
    p = problem(robot, data)
    found = se3.from_vector(x[0, [p.table.index[f"tracker.{s}"] for s in SIX]])
    np.testing.assert_allclose(found, se3.from_vector(away.value), atol=1e-7)


def test_a_frame_that_may_only_shift_keeps_its_turn():
    part = replace(TRACKER, free=(True,) * 3 + (False,) * 3)
    robot, data = arm(), measured(20, frame=part, noise=0, truth=arm())
    _, x = baseline(robot, data, np.arange(20))
    p = problem(robot, data)
    np.testing.assert_allclose(x[0, [p.table.index[f"tracker.{s}"] for s in SIX]], TRACKER.value, atol=1e-7)
