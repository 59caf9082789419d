"""Lists of poses: every way is free and feasible, the limit told is the one that holds, and bad starts are refused."""

from __future__ import annotations

import numpy as np
import pytest
from cables.motions import anchors, body_overlap, pair_distances, pose, sampled

from robocal.cables.interference import box, first_contact
from robocal.cables.poses import LIMITS, PoseBox, default_box, home, reachable_poses
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
    assert made.reached == pytest.approx(4 / 3 * np.pi * 0.4**3, abs=4 * 0.5 / np.sqrt(20_000))
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
