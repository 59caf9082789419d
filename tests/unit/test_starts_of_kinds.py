"""Closed forms behind the starts: exact without noise, near with it, and from any direction."""

from __future__ import annotations

import numpy as np
import pytest
from twists import exp

from robocal.fit.starts.cameras import resect
from robocal.fit.starts.frames import relative_hand
from robocal.fit.starts.places import cube, pivot, reach
from robocal.geometry import se3, so3

SEEDS = range(20)


def anywhere(rng, distance=3.0):
    """A frame that looks from anywhere, turned anyhow."""
    d = rng.normal(size=3)
    return se3.compose(so3.exp(rng.normal(scale=2.0, size=3)), distance * d / np.linalg.norm(d))


def directions(t, p):
    seen = p @ t[:3, :3].T + t[:3, 3]
    return seen / np.linalg.norm(seen, axis=1, keepdims=True)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("flat", [False, True])
@pytest.mark.parametrize("m", [4, 6, 30])
def test_resection(seed, flat, m):
    rng = np.random.default_rng(seed)
    p, t = rng.uniform(-0.5, 0.5, (m, 3)) * (1, 1, 0 if flat else 1) + [0.2, 0.1, 0.4], anywhere(rng)
    # A few points may fit from two sides; the truth is one of those that are handed on.
    found = resect(p, directions(t, p), keep=4)
    assert min(np.abs(f - t).max() for f in found) < (1e-6 if m > 4 and not flat else 0.2 if m == 4 else 0.05)


@pytest.mark.parametrize("seed", SEEDS)
def test_resection_of_an_arm_that_is_off_by_millimetres(seed):
    rng = np.random.default_rng(seed)
    p, t = rng.uniform(-0.5, 0.5, (40, 3)), anywhere(rng)
    found = resect(p + 2e-3 * rng.standard_normal(p.shape), directions(t, p))[0]
    assert np.linalg.norm(so3.log(found[:3, :3] @ t[:3, :3].T)) < 0.02 and np.abs(found - t)[:3, 3].max() < 0.1


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("known", [True, False])
def test_reach_of_readings_that_differ(seed, known):
    """Receivers and telescopic bars: |p - s| = y + L."""
    rng = np.random.default_rng(seed)
    p, s = rng.uniform(-0.5, 0.5, (40, 3)), anywhere(rng, 2.0)[:3, 3]
    y = np.linalg.norm(p - s, axis=1) - 0.07
    ((found, length),) = reach(p, y, 0.07 if known else None)
    np.testing.assert_allclose(found, s, atol=1e-9)
    assert length == pytest.approx(0.07, abs=1e-9)


@pytest.mark.parametrize("known", [True, False])
def test_reach_of_equal_readings_is_a_sphere(rng, known):
    d = rng.normal(size=(30, 3))
    s = np.array([0.4, -0.2, 0.9])
    p = s + 0.3 * d / np.linalg.norm(d, axis=1, keepdims=True)
    ((found, length),) = reach(p, np.full(30, 0.05), 0.25 if known else None)
    np.testing.assert_allclose(found, s, atol=1e-9)
    assert length == pytest.approx(0.25)


def test_points_in_a_plane_leave_two_sides(rng):
    p = rng.uniform(-0.5, 0.5, (30, 3)) * (1, 1, 0) + [0, 0, 0.3]
    s = np.array([0.1, 0.2, 1.3])
    found = reach(p, np.linalg.norm(p - s, axis=1), 0.0)
    assert len(found) == 2
    heights = sorted(float(f[0][2]) for f in found)
    np.testing.assert_allclose(heights, [-0.7, 1.3], atol=1e-9)
    assert reach(p[:3], np.arange(3.0), None) == [], "three points know nothing of four numbers"


def test_pivot(rng):
    c, s = np.array([0.02, -0.05, 0.3]), np.array([0.5, 0.4, 0.1])
    r = so3.exp(rng.normal(size=(12, 3)))
    found = pivot(se3.compose(r, s - r @ c))
    np.testing.assert_allclose(np.concatenate(found), [*c, *s], atol=1e-12)


def test_a_wrist_that_turns_about_one_axis_keeps_the_rest_near(rng):
    """What the turns do not show stays as small as can be, rather than wherever rounding takes it."""
    c, s = np.array([0.02, -0.05, 0.3]), np.array([0.5, 0.4, 0.1])
    r = so3.exp(rng.normal(size=(12, 1)) * [[0.0, 0, 1]])
    found, where = pivot(se3.compose(r, s - r @ c))
    np.testing.assert_allclose(found[:2], c[:2], atol=1e-9)
    assert abs(found[2]) < 1.0 and abs(where[2]) < 1.0


def test_relative_hand_eye(rng):
    x = se3.from_vector([0.05, -0.1, 0.2, 2.0, -1.0, 0.7])
    b = exp(rng.normal(scale=0.8, size=(9, 6)))
    np.testing.assert_allclose(relative_hand(x @ b @ se3.inverse(x), b), x, atol=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("faces", [3, 5])
def test_cube(seed, faces):
    rng = np.random.default_rng(seed)
    normals = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0], [-1, 0, 0]])[:faces]
    n = np.resize(normals, (10 * faces, 3))
    q = np.where(n != 0, 0.0, rng.uniform(-0.05, 0.05, n.shape)) + 0.05 * n
    t = se3.compose(so3.exp(rng.normal(scale=2.0, size=3)), rng.normal(size=3))
    found = cube(q @ t[:3, :3].T + t[:3, 3], n, np.full(len(n), 0.05))
    np.testing.assert_allclose(found, t, atol=1e-9)
    assert cube(q[:2], n[:2], np.full(2, 0.05)) is None, "two contacts are no cube"
