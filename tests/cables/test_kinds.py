"""Cables as sums of segments, anchors on rails, drums that grow: lengths, gradients, tensions, poses, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from cables.kinds import DRUMS, MOVING, PLANAR, RAILS, robot_of

from robocal.cables.cable_lengths import inverse
from robocal.cables.forward import forward
from robocal.cables.geometry import straight
from robocal.cables.gradient import by_parameters
from robocal.cables.prepared import Prepared
from robocal.cables.reeving import Reeving
from robocal.cables.statics import structure_of
from robocal.cables.tension import hold
from robocal.errors import ModelError
from robocal.geometry import se3
from robocal.measure.base import problem, synthesise
from robocal.measure.data import Configurations, DataSet, Observations

CASES = [PLANAR, MOVING, RAILS, DRUMS]
NAMES = ["planar", "moving", "rails", "drums"]


def placed(robot, count=12, seed=3):
    """Poses in the middle of the frame."""
    rng = np.random.default_rng(seed)
    vector = np.tile(se3.to_vector(robot.home[None])[0], (count, 1))
    for i in robot.axes:
        vector[:, i] = rng.uniform(-0.3, 0.3, count) if i > 2 else (0.0, 0.0, 1.4)[i] + 0.8 * rng.uniform(-1, 1, count)
    return se3.from_vector(vector)


def test_every_motor_of_the_planar_robot_has_its_own_sum():
    robot = robot_of(PLANAR)
    t = placed(robot)
    m, n, k, h = (np.linalg.norm(t[:, :3, 3] - a, axis=1) for a in ([-2, 0, 3], [2, 0, 3], [-2, 0, 0], [2, 0, 0.1]))
    own = np.column_stack([m + n - 0.1, m + 2 * k - 0.2, n + 2 * h - 0.3])
    assert np.abs(inverse(robot, t)[0] - own).max() < 1e-12
    found = forward(robot, own)
    assert found.converged.all() and np.abs(found.pose - t).max() < 1e-12


def test_still_segments_differences_and_wheels_are_summed():
    robot = robot_of(MOVING)
    t = placed(robot)
    a, b = robot.frame_points, {1: [-0.2, -0.15, 0.2], 5: [0.1, -0.3, -0.2]}
    at = {i: t[:, :3, 3] + t[:, :3, :3] @ np.array(p) for i, p in b.items()}
    s2 = np.linalg.norm(at[1] - [2, -1.5, 3], axis=1)
    s5 = np.linalg.norm(at[5] - [-2, -1.5, 0], axis=1)
    between, over = 3.0, math.dist([-0.1, 0.3, -0.2], [-0.3, 0.1, -0.2])
    shown = inverse(robot, t)[0]
    assert np.abs(shown[:, 4] - (3 * s5 + between + 2 * over - s2 - 0.4)).max() < 1e-12
    d = at[1] - [-2, -1.5, 3]
    s, h = np.hypot(d[:, 0], d[:, 1]), d[:, 2]
    far = np.hypot(s - 0.05, h)
    wrap = math.pi - np.arctan2(h, s - 0.05) - np.arccos(0.05 / far)
    assert np.abs(shown[:, 0] - s2 - np.sqrt(far**2 - 0.05**2) - 0.05 * (wrap % (2 * math.pi))).max() < 1e-12
    assert len(a) == len(robot.segments.names) - 1 + 1  # s4 lies on the platform, s3 has two ends on the frame


def test_a_cable_once_along_one_segment_is_a_straight_cable():
    text = MOVING.replace("  - {name: c2, frame: A2, platform: B2}", "  - {name: c2, segments: {s6: 1}}")
    text = text.replace("cables:\n", "  s6: {frame: A2, platform: B2}\ncables:\n", 1)
    one, other = robot_of(MOVING), robot_of(text)
    t = placed(one)
    assert (inverse(one, t)[0] == inverse(other, t)[0]).all()
    assert "s6.bx" in other.table and "c2.l0" in other.table
    plain = Reeving.plain(("c1", "c2"))
    assert plain.is_plain and plain.sums(np.ones((2, 2))).tolist() == [[1, 1], [1, 1]]


@pytest.mark.parametrize("text", CASES, ids=NAMES)
def test_gradients_follow_the_lengths(text):
    robot = robot_of(text)
    robot = robot.with_values({n: robot.table[n].value + 0.01 * i for i, n in enumerate(robot.table.names)})
    t, names, step = placed(robot, 5), robot.table.names, 1e-6
    by_pose, by_number = by_parameters(robot, t, names)
    shown = inverse(robot, t)[0]
    per = robot.winding(shown)
    for i in robot.axes:
        move = np.zeros((len(t), 6))
        move[:, i] = step
        ahead, behind = (straight(robot, se3.displace(t, s * move[:, :3], s * move[:, 3:]))[0] for s in (1, -1))
        assert np.abs((ahead - behind) / (2 * step) - by_pose[..., i]).max() < 1e-8
    for i, name in enumerate(names):
        ahead, behind = (inverse(robot.with_values({name: robot.table[name].value + s * step}), t)[0] for s in (1, -1))
        assert np.abs((ahead - behind) / (2 * step) - by_number[..., i] / per).max() < 1e-7, name


@pytest.mark.parametrize("text", CASES, ids=NAMES)
def test_rows_of_measured_lengths_agree_with_the_model(text):
    robot = robot_of(text)
    robot = robot.with_table(robot.table.with_free(robot.table.names))
    t, m = placed(robot, 6), len(robot.cables)
    extra = {"cable": np.tile(np.arange(m, dtype=float), len(t))}
    stood = robot
    if text == RAILS:
        stood = robot.with_values({"c3.carriage": 0.7})
        extra["carriage"] = np.where(extra["cable"] == 2, 0.7, np.nan)
    seen = Observations(
        "lengths",
        np.repeat(np.arange(len(t)), m),
        np.zeros((len(t) * m, 1)),
        np.full((len(t) * m, 1), 1e-3),
        extra=extra,
    )
    still = Observations("pose", np.arange(len(t)), se3.to_vector(t), np.full((len(t), 6), 1e-3))
    data = DataSet(Configurations(tuple(map(str, range(len(t)))), start=se3.to_vector(t)), (seen, still))
    made = synthesise(robot, data, None)
    assert np.abs(made.observations[0].value.reshape(-1, m) - inverse(stood, t)[0]).max() < 1e-12
    posed = problem(stood, made)
    assert np.abs(posed.linearize(posed.start).r).max() < 1e-9


@pytest.mark.parametrize("text", CASES, ids=NAMES)
def test_poses_come_back_from_lengths(text):
    robot = robot_of(text)
    t = placed(robot)
    found = forward(robot, inverse(robot, t)[0], start=se3.displace(t, np.array([0.02, 0.0, -0.03]), np.zeros(3)))
    assert found.converged.all() and np.abs(found.pose - t).max() < 1e-10


def test_tensions_do_the_work_of_their_lengths():
    """W = -L^T: what a newton in a motor's cable does is what its length gains by a motion."""
    robot = robot_of(PLANAR)
    t = placed(robot)
    w = structure_of(robot, t)
    assert np.abs(w + inverse(robot, t)[1][..., list(robot.axes)].swapaxes(1, 2)).max() < 1e-12
    held = hold(robot, t)
    assert held.feasible.any()
    left = np.einsum("kdm,km->kd", w, held.tension)[held.feasible]
    assert np.abs(left - [0.0, 5 * 9.80665]).max() < 1e-9
    one = Prepared(robot)
    for k in np.flatnonzero(held.feasible)[:3]:
        assert np.abs(one.tension(t[k]).tension - held.tension[k]).max() < 1e-9
        there = one.forward(inverse(robot, t[k])[0][0], robot.home)
        assert there.converged and np.abs(there.pose - t[k]).max() < 1e-10


def test_drums_wind_up_what_they_show():
    robot = robot_of(DRUMS)
    y = np.linspace(-1.0, 6.0, 80).reshape(-1, 8)
    assert np.abs(robot.readings(robot.wound(y)) - y).max() < 1e-12
    assert np.abs(robot.wound(y) - (1.02 * y + 0.03 * y**2)).max() < 1e-12
    with pytest.raises(ModelError, match="drums that grow"):
        Prepared(robot, mass=5.0, limits=np.tile([1.0, 500.0], (8, 1)))


@pytest.mark.parametrize("what", ["a", "b", "numbers", "pulleys"])
def test_who_takes_cables_as_straight_is_told_which_is_not(what):
    with pytest.raises(ModelError, match="a cable is a sum of segments") as caught:
        getattr(robot_of(PLANAR), what)
    assert caught.value.key == "M2" and caught.value.found == "M2 = m + 2 k"


def test_anchors_on_rails_stand_where_their_carriage_does():
    robot = robot_of(RAILS)
    d = np.array([0, 0.3, -1]) / math.hypot(0.3, 1)
    assert np.abs(robot.a[2] - [2, 1.5, 3] - 1.1 * 0.4 * d).max() < 1e-15
    with pytest.raises(ModelError, match="on a rail"):
        robot.need_straight(fixed=True)
