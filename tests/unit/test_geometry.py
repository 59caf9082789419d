"""Rotations and motions: group axioms, exp and log, Jacobians, fits, and kernels against their NumPy twins."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from laws import check_jacobian
from scipy.linalg import expm
from scipy.spatial.transform import Rotation
from twists import exp

from robocal.errors import ModelError
from robocal.geometry import fits, se3, so3
from robocal.geometry._kernels import nearest_rotation, rotation_from_vector, turn_vectors, vector_from_rotation

number = st.floats(-3, 3, allow_nan=False)
vector3 = st.tuples(number, number, number).map(np.array)
twist6 = st.tuples(vector3, vector3).map(np.concatenate)
# Angles where formulas change branch: zero, the series' limits, pi from both sides.
ANGLES = (
    0.0,
    1e-300,
    1e-15,
    1e-9,
    9.9e-7,
    1.01e-6,
    9.9e-5,
    1.01e-4,
    9.9e-4,
    1.01e-3,
    0.3,
    2.0,
    np.pi - 1e-5,
    np.pi - 1e-9,
)
AXES = [
    np.eye(3)[0],
    -np.eye(3)[1],
    np.eye(3)[2],
    np.array([1, 1, 1]) / np.sqrt(3),
    np.array([0.6, 0, -0.8]),
    np.array([-1, 2, 2]) / 3,
]


def within_pi(w):
    """The rotation vector of the same rotation with angle at most pi."""
    return Rotation.from_rotvec(w).as_rotvec()


@given(vector3, vector3, vector3)
def test_rotations_are_a_group(a, b, c):
    ra, rb, rc = so3.exp(a), so3.exp(b), so3.exp(c)
    np.testing.assert_allclose(ra @ ra.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(ra) == pytest.approx(1)
    np.testing.assert_allclose((ra @ rb) @ rc, ra @ (rb @ rc), atol=1e-14)
    np.testing.assert_allclose(so3.exp(-a), ra.T, atol=1e-15)
    np.testing.assert_allclose(ra, Rotation.from_rotvec(a).as_matrix(), atol=1e-14)


@given(twist6, twist6)
def test_motions_are_a_group(x, y):
    a, b = exp(x), exp(y)
    np.testing.assert_allclose(a @ se3.inverse(a), np.eye(4), atol=1e-13)
    np.testing.assert_allclose(se3.inverse(a @ b), se3.inverse(b) @ se3.inverse(a), atol=1e-12)
    generator = np.zeros((4, 4))
    generator[:3, :3], generator[:3, 3] = so3.skew(x[3:]), x[:3]
    np.testing.assert_allclose(a, expm(generator), atol=1e-12)


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("axis", AXES, ids=str)
def test_exp_and_log_are_inverse_up_to_pi(axis, angle):
    w = angle * axis
    np.testing.assert_allclose(so3.log(so3.exp(w)), w, rtol=1e-9 if angle > 3 else 1e-12, atol=1e-15)
    twist = np.concatenate([[0.3, -0.2, 0.5], w])
    np.testing.assert_allclose(se3.to_vector(se3.from_vector(twist)), twist, atol=1e-9 if angle > 3 else 1e-14)


@pytest.mark.parametrize("axis", AXES, ids=str)
def test_half_turns_keep_their_axis(axis):
    w = so3.log(so3.exp(np.pi * axis))
    assert np.linalg.norm(w) == pytest.approx(np.pi, abs=1e-9)
    assert abs(w @ axis) == pytest.approx(np.pi, abs=1e-9)


@given(vector3)
def test_log_is_scipys(w):
    r = so3.exp(w)
    found, expected = so3.log(r), within_pi(w)
    # Beside a half turn both signs of the axis are right.
    assert (
        min(
            np.abs(found - expected).max(), np.abs(found + expected).max() if np.linalg.norm(expected) > 3.1 else np.inf
        )
        < 1e-7
    )
    assert np.linalg.norm(found) <= np.pi + 1e-12


@pytest.mark.parametrize("angle", [a for a in ANGLES if 1e-5 < a < 3] + [3.1])
@pytest.mark.parametrize("axis", AXES[2:], ids=str)
def test_left_jacobian(axis, angle):
    w = angle * axis
    away = so3.exp(w).T
    check_jacobian(lambda v: so3.log(so3.exp(v) @ away), so3.left_jacobian, w, tolerance=1e-7, step=1e-3)
    check_jacobian(
        lambda d: so3.log(so3.exp(d) @ so3.exp(w)),
        lambda d: so3.left_jacobian_inverse(w),
        np.zeros(3),
        tolerance=1e-7,
        step=1e-3,
    )


@pytest.mark.parametrize("angle", ANGLES)
def test_left_jacobian_times_its_inverse(angle):
    w = angle * AXES[5]
    np.testing.assert_allclose(so3.left_jacobian(w) @ so3.left_jacobian_inverse(w), np.eye(3), atol=1e-11)


def test_series_meet_the_closed_formulas(rng):
    """On both sides of every switch the functions are the same: a wrong coefficient would leave a step."""
    for function, limit in ((so3.exp, 1e-4), (so3.left_jacobian, 1e-4), (so3.left_jacobian_inverse, 1e-3)):
        w = AXES[5] * limit
        low, high = function(w * (1 - 1e-9)), function(w * (1 + 1e-9))
        assert np.abs(low - high).max() < 5e-12, function.__name__


def test_batches_are_singles(rng):
    w = rng.normal(size=(2, 4, 3))
    for function in (so3.exp, so3.left_jacobian, so3.left_jacobian_inverse, so3.skew):
        np.testing.assert_array_equal(function(w)[1, 2], function(w[1, 2]))
    r = so3.exp(w)
    np.testing.assert_array_equal(so3.log(r)[1, 2], so3.log(r[1, 2]))
    np.testing.assert_array_equal(so3.project(r + 0.1)[0, 3], so3.project(r[0, 3] + 0.1))
    np.testing.assert_allclose(so3.skew(w[0, 0]) @ w[0, 1], np.cross(w[0, 0], w[0, 1]), atol=1e-15)


def test_project_gives_the_nearest_rotation(rng):
    for _ in range(20):
        m = rng.normal(size=(3, 3))
        r = so3.project(m)
        np.testing.assert_allclose(r @ r.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(r) == pytest.approx(1)
        others = so3.exp(rng.normal(scale=0.05, size=(200, 3))) @ r
        assert np.linalg.norm(m - r) <= np.linalg.norm(m - others, axis=(1, 2)).min()


def test_rigid_fit_finds_the_motion_and_never_a_mirror(rng):
    a = rng.normal(size=(6, 3))
    t = exp(rng.normal(size=6))
    b = a @ t[:3, :3].T + t[:3, 3]
    np.testing.assert_allclose(fits.rigid(a, b), t, atol=1e-12)
    np.testing.assert_allclose(fits.rigid(a[:3], b[:3]), t, atol=1e-12)
    assert np.linalg.det(fits.rigid(a, -a)[:3, :3]) == pytest.approx(1)
    noisy = b + rng.normal(scale=0.01, size=b.shape)
    best = fits.rigid(a, noisy)

    def cost(m):
        return np.sum((a @ m[:3, :3].T + m[:3, 3] - noisy) ** 2)

    assert all(cost(best) <= cost(exp(rng.normal(scale=1e-3, size=6)) @ best) for _ in range(100))
    with pytest.raises(ModelError, match="three points"):
        fits.rigid(a[:2], b[:2])


def test_plane_fit(rng):
    normal, offset = AXES[5], 0.7
    u, v = np.linalg.svd(normal[None])[2][1:]
    p = rng.normal(size=(30, 1)) * u + rng.normal(size=(30, 1)) * v + offset * normal
    n, c, distance = fits.plane(p)
    assert abs(n @ normal) == pytest.approx(1) and abs(c) == pytest.approx(offset) and np.sign(n @ normal) == np.sign(c)
    assert np.abs(distance).max() < 1e-14
    lifted = p + np.linspace(-1e-3, 1e-3, 30)[:, None] * normal
    n, c, distance = fits.plane(lifted)
    np.testing.assert_allclose(distance, lifted @ n - c, atol=1e-14)
    # Three points always lie in a plane.
    assert np.abs(fits.plane(rng.normal(size=(3, 3)))[2]).max() < 1e-14


# --- kernels and their twins ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("angle", [*ANGLES, np.pi])
@pytest.mark.parametrize("axis", AXES, ids=str)
def test_rotation_kernels_equal_their_twins(axis, angle):
    w = angle * axis
    r, v = np.empty((3, 3)), np.empty(3)
    rotation_from_vector(*w, r)
    np.testing.assert_allclose(r, so3.exp(w), atol=1e-15)
    vector_from_rotation(r, v)
    np.testing.assert_allclose(v, so3.log(r), atol=1e-9 if angle > 3 else 1e-14)


def test_every_branch_of_the_logarithm(rng):
    """Turns near pi about random axes take the branches of x, y and z; small ones that of w."""
    v = np.empty(3)
    taken = set()
    for w in np.concatenate(
        [rng.normal(size=(50, 3)), 3.1 * AXES[5] * np.ones((1, 1)), 3.1 * np.eye(3), -3.1 * np.eye(3)]
    ):
        r = so3.exp(w)
        taken.add("w" if np.trace(r) > 0 else "xyz"[int(np.argmax(np.diag(r)))])
        vector_from_rotation(r, v)
        np.testing.assert_allclose(so3.exp(v), r, atol=1e-13)
        assert np.linalg.norm(v) <= np.pi + 1e-12
    assert taken == {"w", "x", "y", "z"}


def test_turn_vectors_steps_on_the_group(rng):
    values, step = rng.normal(size=(4, 9)), rng.normal(size=(4, 5))
    before = values.copy()
    at, columns = np.array([1, 5]), np.array([[0, 2, 4], [-1, 3, -1]])
    turn_vectors(values, at, step, columns)
    for b in range(4):
        np.testing.assert_allclose(
            so3.exp(values[b, 1:4]), so3.exp(step[b, [0, 2, 4]]) @ so3.exp(before[b, 1:4]), atol=1e-13
        )
        held = np.array([0, step[b, 3], 0])
        np.testing.assert_allclose(so3.exp(values[b, 5:8]), so3.exp(held) @ so3.exp(before[b, 5:8]), atol=1e-13)
    np.testing.assert_array_equal(values[:, [0, 4, 8]], before[:, [0, 4, 8]])
    still = values.copy()
    turn_vectors(values, at, np.zeros((4, 5)), columns)
    np.testing.assert_array_equal(values, still)


def test_the_nearest_rotation_is_that_of_the_singular_values(rng):
    """Of any matrix, of a turned stretch, of a mirror image, and of one that is all but flat."""
    some = rng.normal(size=(60, 3, 3))
    turns = so3.exp(rng.normal(size=(60, 3)))
    some[20:40] = turns[20:40] @ (np.eye(3) * rng.uniform(0.5, 2, (20, 3))[:, None])
    some[40:50] = turns[40:50] @ np.diag([2.0, 1, -0.5])
    some[50:] = turns[50:] @ np.diag([2.0, 1, 1e-9])
    a, v, out = np.empty((4, 4)), np.empty((4, 4)), np.empty((3, 3))
    for size in (1e-6, 1.0, 1e6):
        for m in some:
            nearest_rotation(np.ravel(size * m), a, v, out)
            np.testing.assert_allclose(out, so3.project(m), atol=1e-12)
