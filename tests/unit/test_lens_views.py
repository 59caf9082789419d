"""Views that would say most of a lens: what is foretold of them, and that they are what is said."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robocal.planning.lens_views import next_views
from robocal.vision.camera import MODELS, image_of, unproject

SIZE = 1280, 960
X, Y = np.meshgrid(np.arange(9) * 0.02, np.arange(6) * -0.02)
BOARD = np.column_stack([X.ravel(), Y.ravel(), 0 * X.ravel()])
LENSES = {
    "brown": [900.0, 905, 640, 480, -0.2, 0.05, 0.001, 0, 0],
    "fisheye": [420.0, 421, 640, 480, 0.01, -0.002, 0, 0],
}
EXPECTED = {
    "brown": np.array([400.0, 400, 64, 64, 0.3, 0.3, 0.01, 0.01, 0.3]),
    "fisheye": np.array([400.0, 400, 64, 64, 0.3, 0.3, 0.3, 0.3]),
}


def frontal(count):
    out = np.tile(np.eye(4), (count, 1, 1))
    out[:, :3, :3] = np.diag([1.0, -1.0, -1.0])
    out[:, :3, 3] = [-0.08, -0.05, 0.4]
    out[:, 2, 3] += np.arange(count) * 0.02
    return out


def wanted(name, count, sigma=0.1, poses=None):
    lens, expected = np.array(LENSES[name]), EXPECTED[name]
    poses = frontal(4) if poses is None else poses
    return next_views(BOARD, poses, lens, range(len(lens)), expected, SIZE, sigma, count)


def derivative(function, x, steps):
    columns = []
    for i, step in enumerate(steps):
        d = np.zeros(len(x))
        d[i] = step
        columns.append((function(x + d) - function(x - d)).ravel() / (2 * step))
    return np.array(columns).T


def sure(name, poses, sigma):
    """The mean sigma of a pixel by the whole Jacobian: all numbers of the lens, all poses, differences."""
    lens, expected = np.array(LENSES[name]), EXPECTED[name]
    k = len(lens)

    def corners(x):
        out = []
        for pose, d in zip(poses, x[k:].reshape(-1, 6), strict=True):
            turn = Rotation.from_rotvec(d[3:]).as_matrix() @ pose[:3, :3]
            out.append(image_of(BOARD @ turn.T + pose[:3, 3] + d[:3], x[:k]))
        return np.concatenate(out)

    x = np.concatenate([lens, np.zeros(6 * len(poses))])
    steps = np.concatenate([1e-5 * expected, np.full(6 * len(poses), 1e-6)])
    j = derivative(corners, x, steps) / sigma
    prior = np.diag(np.concatenate([1 / expected**2, np.zeros(6 * len(poses))]))
    covariance = np.linalg.inv(j.T @ j + prior)[:k, :k]
    u, v = np.meshgrid(np.linspace(0, SIZE[0] - 1, 7), np.linspace(0, SIZE[1] - 1, 5))
    ways = unproject(np.stack([u.ravel(), v.ravel()], axis=1), lens)
    ways = ways[np.isfinite(ways).all(axis=1)]
    t = derivative(lambda n: image_of(ways, n), lens, 1e-5 * expected).reshape(-1, 2, k)
    return float(np.sqrt(np.mean(np.einsum("tdi,ij,tdj->t", t, covariance, t))))


@pytest.mark.parametrize("name", sorted(LENSES))
def test_what_is_foretold_is_what_all_rows_together_say(name):
    now, views = wanted(name, 3)
    assert name in MODELS and now == pytest.approx(sure(name, frontal(4), 0.1), rel=1e-3)
    poses = frontal(4)
    for view in views:
        poses = np.concatenate([poses, view.pose[None]])
        assert view.sure == pytest.approx(sure(name, poses, 0.1), rel=1e-3)
    assert now > views[0].sure > views[1].sure > views[2].sure


@pytest.mark.parametrize("name", sorted(LENSES))
def test_views_are_where_they_are_said_to_be(name):
    lens = np.array(LENSES[name])
    _, views = wanted(name, 12)
    assert len(views) == 12 and any(v.tilt > 0 for v in views)
    for v in views:
        seen = BOARD @ v.pose[:3, :3].T + v.pose[:3, 3]
        uv = image_of(seen, lens)
        assert (uv > 0).all() and (uv < np.array(SIZE) - 1).all() and v.pose[2, 2] < 0
        middle = image_of(((seen.max(axis=0) + seen.min(axis=0)) / 2)[None], lens)[0]
        assert np.allclose(middle, (np.array(SIZE) - 1) * (1 + np.array(v.middle)) / 2, atol=2.0)
        lean = np.hypot(*v.pose[:2, 2])
        assert np.arcsin(lean) == pytest.approx(v.tilt, abs=1e-9)
        if v.tilt:
            toward = (uv - uv.mean(axis=0)) @ v.away
            assert seen[toward > 0, 2].mean() > seen[toward < 0, 2].mean()


def test_frontal_views_ask_for_tilted_ones_and_choice_beats_chance():
    now, views = wanted("brown", 30)
    assert views[0].tilt > 0 and views[0].sure < now / 5
    rng = np.random.default_rng(2)
    chosen = sure("brown", np.concatenate([frontal(4), [v.pose for v in views[:4]]]), 0.1)
    for _ in range(6):
        some = rng.permutation(30)[:4]
        assert chosen < sure("brown", np.concatenate([frontal(4), [views[i].pose for i in some]]), 0.1)


def test_a_target_that_no_view_can_show_whole_has_no_views():
    _, views = next_views(
        BOARD * [1, 1, 1] + [[0, 0, 10.0]] * (np.arange(54) % 2)[:, None], frontal(1), np.array(LENSES["brown"]), range(9),
        EXPECTED["brown"], SIZE, 0.1, 5,
    )  # fmt: skip
    assert views == ()
