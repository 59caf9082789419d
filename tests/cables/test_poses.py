"""Lists of poses: every way is free and feasible, the limit told is the one that holds, and bad starts are refused."""

from __future__ import annotations

import numpy as np
import pytest
from cables.motions import anchors, body_overlap, pair_distances, pose, sampled

from robocal.cables.geometry import cable_robot, home
from robocal.cables.interference import box, first_contact, hull
from robocal.cables.pose_list import LIMITS, PoseBox, default_box, reachable_poses
from robocal.errors import ModelError
from robocal.geometry import se3, so3

D = 0.0048


def ball(radius):
    """Statics that let the platform go `radius` from where it starts."""
    return lambda start, v, w: np.minimum(1, radius / np.linalg.norm(v, axis=1))


def laval(n, seed=0, **more):
    a, b = anchors("laval")
    shape = box((0.3, 0.1, 0.1))
    return a, b, shape, reachable_poses(a, b, n, np.random.default_rng(seed), diameter=D, body=shape, **more)


def test_defaults_are_those_of_the_thesis():
    a, b, _, made = laval(50)
    np.testing.assert_allclose(made.start, pose(a.mean(axis=0)))
    z = default_box(a)
    np.testing.assert_allclose(z.translation, 0.55 * np.ptp(a, axis=0))
    assert (np.abs(made.translation) <= z.translation).all() and (np.abs(made.rotation) <= z.rotation).all()
    assert np.abs(made.translation).max(axis=0) == pytest.approx(z.translation, rel=0.1)
    np.testing.assert_allclose(made.along([0.0])[:, 0], np.broadcast_to(home(a), (50, 4, 4)), atol=1e-15)
    again = laval(50)[-1]
    np.testing.assert_array_equal(made.poses, again.poses)


def test_every_way_is_free_and_the_margin_is_kept():
    a, b, shape, made = laval(60, margin=0.9)
    np.testing.assert_allclose(made.fraction, 0.9 * made.furthest)
    pairs = np.stack(np.triu_indices(8, 1), axis=1)
    for i in range(60):
        v, w = made.fraction[i] * made.translation[i], made.fraction[i] * made.rotation[i]
        _, r, p, ends = sampled(a, b, made.start, v, w, 300)
        assert pair_distances(a, ends, pairs)[0].min() > D
        assert not body_overlap(a, b, r, p, shape.normals, shape.offsets, 10 * D, D / 2).any()
        np.testing.assert_allclose(se3.compose(r[-1], p[-1]), made.poses[i], atol=1e-12)
        np.testing.assert_allclose(made.along([1.0, 0.5, 0.0])[i, 1], se3.compose(r[150], p[150]), atol=1e-12)
    assert (made.limit == LIMITS.index("cable-cable")).any()
    assert set(np.unique(made.limit)) <= {0, 2, 3}


def test_the_smaller_of_statics_and_contact_stops_the_motion():
    a, b, shape, made = laval(300, feasible=ball(0.4), margin=1.0)
    contact = first_contact(a, b, made.start, made.translation, made.rotation, diameter=D, body=shape)
    statics = np.minimum(1, 0.4 / np.linalg.norm(made.translation, axis=1))
    np.testing.assert_allclose(made.furthest, np.minimum(statics, contact.fraction))
    assert (np.linalg.norm(made.poses[:, :3, 3] - made.start[:3, 3], axis=1) <= 0.4 + 1e-12).all()
    by_statics = made.limit == LIMITS.index("statics")
    np.testing.assert_array_equal(by_statics, statics < contact.fraction)
    assert by_statics.any() and (made.limit == LIMITS.index("cable-cable")).any()


def test_the_share_of_the_box_that_is_reached():
    """Where only a ball of statics stops the motion, the share is the ball's share of the box."""
    a, b = anchors("ipanema_1")
    z = PoseBox(np.full(3, 0.5), np.zeros(3))
    made = reachable_poses(a, b, 20_000, np.random.default_rng(1), feasible=ball(0.4), box=z)
    assert made.reach_share == pytest.approx(4 / 3 * np.pi * 0.4**3, abs=4 * 0.5 / np.sqrt(20_000))
    assert (made.limit[made.furthest == 1] == 0).all()


def test_another_start_turns_the_whole_list():
    a, b = anchors("laval")
    start = pose([0.1, 0.2, 1.5], so3.exp(np.array([0.05, 0.1, -0.05])))
    made = reachable_poses(a, b, 5, np.random.default_rng(2), start=start)
    lam = made.fraction[:, None]
    np.testing.assert_allclose(made.poses[:, :3, :3], so3.exp(lam * made.rotation) @ start[:3, :3], atol=1e-14)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"n": 0}, "number of poses"),
        ({"margin": 0.0}, "margin"),
        ({"margin": 1.1}, "margin"),
        ({"box": PoseBox(np.array([1.0, -1, 1]), np.zeros(3))}, "box of poses"),
        ({"diameter": 0.01}, "at the start X_0 cable [1-8] meets cable [1-8]"),
        ({"feasible": lambda start, v, w: np.full(len(v), np.nan)}, "the start X_0 is not feasible"),
        ({"feasible": lambda start, v, w: np.ones(2)}, "one number per motion"),
    ],
)
def test_bad_input(change, message):
    a, b = anchors("laval")
    given = {"a": a, "b": b, "n": 10, "rng": np.random.default_rng(0)} | change
    with pytest.raises(ModelError, match=message):
        reachable_poses(**given)


def test_a_start_away_from_the_middle_gets_a_box_that_holds_the_machine():
    a, _ = anchors("cogiro")
    start = pose(a.mean(axis=0) - [1.0, 0, 3.0])
    z = default_box(a, start=start)
    low, high = start[:3, 3] - z.translation, start[:3, 3] + z.translation
    assert (low <= a.min(axis=0)).all() and (high >= a.max(axis=0)).all()
    assert default_box(a, start=home(a)).translation == pytest.approx(default_box(a).translation)


def test_a_box_of_ones_own_may_lie_anywhere():
    a, b = anchors("ipanema_1")
    z = PoseBox(np.array([0.2, 0.1, 0.3]), np.zeros(3), np.array([0.5, -0.2, 0.1]))
    made = reachable_poses(a, b, 500, np.random.default_rng(3), box=z)
    assert (np.abs(made.translation - z.offset) <= z.translation).all()
    assert np.abs(made.translation.mean(axis=0) - z.offset).max() < 0.05 and not made.rotation.any()


# A planar robot moves in its plane only, and its cables are where its file puts them.

UPRIGHT = np.array([[-2, 0, 3], [2, 0, 3], [0, 0, 0.0]])


@pytest.mark.parametrize(
    ("degrees", "plane", "axes"),
    [("2T", "xz", (0, 2)), ("2T", "xy", (0, 1)), ("1R2T", "xz", (0, 2, 4)), ("1R2T", "xy", (0, 1, 5))],
)
def test_a_planar_robot_stays_in_its_plane(degrees, plane, axes):
    a = UPRIGHT if plane == "xz" else UPRIGHT[:, [0, 2, 1]]
    robot = cable_robot("planar", a, 0.05 * (a - a.mean(axis=0)), degrees=degrees, plane=plane)
    assert robot.axes == axes
    made = reachable_poses(robot.a, robot.b, 200, np.random.default_rng(4), axes=robot.axes)
    twist = np.concatenate([made.translation, made.rotation], axis=1)
    assert not np.delete(twist, axes, axis=1).any() and (twist[:, axes].std(axis=0) > 0.1).all()
    across = 1 if plane == "xz" else 2
    np.testing.assert_allclose(made.poses[:, across, 3], a[:, across].mean(), atol=1e-12)


def test_cables_that_end_in_one_point_meet_only_where_one_lies_along_another():
    """Behind its anchor, in line with the next one: outside the triangle of the anchors, where tensions hold nothing anyway."""
    b = np.zeros((3, 3))
    inside = reachable_poses(
        UPRIGHT, b, 300, np.random.default_rng(5), diameter=D, body=hull(b), axes=(0, 2),
        box=PoseBox(np.array([0.5, 0, 0.5]), np.zeros(3)),
    )  # fmt: skip
    assert inside.reach_share == 1.0
    # Straight up through the line of the two upper anchors: there they point at each other, and do not touch.
    up = first_contact(UPRIGHT, b, pose([0, 0, 2.0]), [[0, 0, 2.0]], diameter=D, body=hull(b))
    assert up.free[0]
    # Through that line beyond the right anchor: there the left cable lies on the right one.
    beyond = first_contact(UPRIGHT, b, pose([3, 0, 2.0]), [[0, 0, 2.0]], diameter=D, body=hull(b))
    assert beyond.names(["c1", "c2", "c3"]) == ["c1 meets c2"] and 0.4 < beyond.fraction[0] < 0.5
    # Into the right anchor itself: the platform has arrived.
    into = first_contact(UPRIGHT, b, pose([0, 0, 3.0]), [[4.0, 0, 0]], diameter=D, body=hull(b))
    assert into.names(["c1", "c2", "c3"]) == ["c2 meets the platform"] and into.fraction[0] == pytest.approx(
        0.5, abs=1e-3
    )


def test_cables_in_layers_pass_each_other():
    """Crossed cables of a planar robot that turns: in one plane they touch from the start, in layers they do not."""
    a = np.array([[-2, 0, 2], [2, 0, 2], [-2, 0, 0], [2, 0, 0.0]])
    b = np.array([[0.2, 0, -0.2], [-0.2, 0, -0.2], [0.2, 0, 0.2], [-0.2, 0, 0.2]])
    with pytest.raises(ModelError, match="at the start X_0 cable 1 meets cable 2"):
        reachable_poses(a, b, 5, np.random.default_rng(6), diameter=D, axes=(0, 2, 4))
    layer = np.zeros((4, 3))
    layer[:, 1] = [-0.03, -0.01, 0.01, 0.03]
    made = reachable_poses(a + layer, b + layer, 200, np.random.default_rng(6), diameter=D, axes=(0, 2, 4))
    assert made.contacts.free.all()
