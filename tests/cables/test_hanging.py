"""Sagging cables over pulleys: against chains of springs, against their limits, and there and back."""

from __future__ import annotations

import numpy as np
import pytest
from cables.cable_robots import box, poses
from cables.test_lengths import heavy, wheels
from laws import check_jacobian
from scipy.optimize import fsolve

from robocal.cables.cable_lengths import inverse
from robocal.cables.elastic import hang_by_tension, stretch
from robocal.cables.hanging import hang
from robocal.cables.pulley import Pulleys, run
from robocal.errors import ModelError

UP = np.array([0.0, 0.0, 1.0])


def cables(rng, n, upright=False):
    """Ends, swivel axes, radii, tensions and weights of any cables at all."""
    axis = np.tile(UP, (n, 1)) if upright else rng.normal(size=(n, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    ends = rng.normal(size=(n, 3)) * [3, 3, 2]
    return ends, axis, rng.uniform(0.02, 0.12, n), rng.uniform(20, 200, n), rng.uniform(0.05, 2, n)


def leaves(n, away, r, turn, beta):
    """Where and in which direction the cable leaves a wheel that has swivelled by `turn` from the direction `away`."""
    side = away - (away @ n) * n
    side /= np.linalg.norm(side)
    side = np.cos(turn) * side + np.sin(turn) * np.cross(n, side)
    at = r * (1 - np.cos(beta)) * side + r * np.sin(beta) * n
    return at, np.sin(beta) * side + np.cos(beta) * n


@pytest.mark.parametrize("upright", [True, False])
def test_against_500_elements(upright, rng):
    """A chain of 500 springs that leaves the wheel as the tangent, shot from there: four unknowns (swivel, wrap,
    tension and length), no catenary and no derivative of the product's."""
    count, e = 500, 1e-4
    middle = (np.arange(count) + 0.5) / count

    def end(y, n, away, r, w):
        at, u = leaves(n, away, r, y[0], y[1])
        force = y[2] * u + w * y[3] * middle[:, None] * UP
        size = np.linalg.norm(force, axis=1, keepdims=True)
        points = at + (y[3] / count * (1 + e * size) * force / size).sum(axis=0)
        return points, np.linalg.norm(y[2] * u + w * y[3] * UP)

    for d, n, r, t, w in zip(*cables(rng, 12, upright), strict=True):
        found = hang(d, t, w, e, Pulleys(r, n))
        start = [0.0, float(found.wrap) * 1.02, t * 0.98, float(found.length) * 0.99]

        def miss(y, d=d, n=n, r=r, t=t, w=w):
            place, pull = end(y, n, d, r, w)
            return [*(place - d), (pull - t) / 100]

        y = fsolve(miss, start, xtol=1e-12)
        assert np.abs(miss(y)).max() < 1e-9
        assert found.wrap == pytest.approx(y[1], abs=1e-5)
        assert found.length == pytest.approx(r * y[1] / (1 + e * y[2]) + y[3], rel=1e-6)
        np.testing.assert_allclose(
            found.force, y[2] * leaves(n, d, r, y[0], y[1])[1] + w * y[3] * UP, rtol=0, atol=1e-4 * t
        )
        if upright:  # the wheel stays in the vertical plane through its cable's ends
            assert abs(y[0]) < 1e-9 and abs(found.force[0] * d[1] - found.force[1] * d[0]) < 1e-12 * t
        else:
            taut, _ = run(d, Pulleys(r, n))
            assert abs(y[0]) > 0 and found.length != pytest.approx(stretch(taut, t, e)[0], rel=1e-7)


def test_without_weight_a_stretched_cable_over_a_pulley(rng):
    d, n, r, t, _ = cables(rng, 500)
    taut, u = run(d, Pulleys(r, n))
    inside = np.isnan(taut)
    for weight, room in ((0.0, 1e-13), (1e-9, 1e-9)):
        hung = hang(d, t, weight, 1e-5, Pulleys(r, n))
        np.testing.assert_array_equal(np.isnan(hung.length), inside)
        np.testing.assert_allclose(hung.length, stretch(taut, t, 1e-5)[0], atol=room)
        np.testing.assert_allclose(hung.force, t[:, None] * u, atol=1e5 * room)
        np.testing.assert_allclose(hung.gradient, u / (1 + 1e-5 * t)[:, None], atol=100 * room)


def test_without_radius_plain_sag(rng):
    d, n, _, t, w = cables(rng, 500)
    plain = hang(d, t, w, 1e-5)
    across = np.hypot(d[:, 0], d[:, 1])
    np.testing.assert_allclose(plain.length, hang_by_tension(np.stack([across, d[:, 2]], -1), t, w, 1e-5).length)
    small = hang(d, t, w, 1e-5, Pulleys(np.array(1e-9), n))
    np.testing.assert_allclose(small.length, plain.length, atol=1e-8)
    np.testing.assert_allclose(small.force, plain.force, atol=1e-5)
    np.testing.assert_allclose(small.gradient, plain.gradient, atol=1e-7)
    mixed = hang(d, t, w, 1e-5, Pulleys(np.where(np.arange(500) % 2, 0.1, 0.0), n))
    np.testing.assert_array_equal(mixed.length[::2], plain.length[::2])
    assert (np.abs(mixed.length - plain.length)[1::2] > 1e-6).all()


def test_a_cable_that_hangs_straight_down(rng):
    """Below the tangent of the wheel after half a turn: nothing pulls across, and no derivative is lost."""
    d, r, t, w, e = np.array([0.2, 0.0, -3.0]), 0.1, 50.0, 2.0, 1e-4
    hung = hang(d, t, w, e, Pulleys(r, UP))
    assert hung.wrap == pytest.approx(np.pi, abs=1e-12)
    np.testing.assert_allclose(hung.force, [0, 0, -t], atol=1e-9)
    # From the tension t at the lower end upwards: 3 m = L + e (t L + w L^2 / 2).
    free = (-(1 + e * t) + np.sqrt((1 + e * t) ** 2 + 6 * e * w)) / (e * w)
    assert hung.length == pytest.approx(free + r * np.pi / (1 + e * (t + w * free)), abs=1e-12)
    check_jacobian(
        lambda x: hang(d + x, t, w, e, Pulleys(r, UP)).length[None],
        lambda x: hang(d + x, t, w, e, Pulleys(r, UP)).gradient[None],
        np.zeros(3),
        tolerance=1e-6,
    )


def test_stretch_sag_and_pulley_add_up(rng):
    """To first order in the weight squared: the excess of a parabola between wheel and platform, and the stretch by
    the tension along the cable, which is not that at the platform."""
    w, t, e, r = 0.122, 60.0, 2.5e-5, 0.05
    wheel = Pulleys(np.full(8, r), np.tile(UP, (8, 1)))
    robot = box().having(pulleys=wheel, density=np.full(8, w), elasticity=np.full(8, e))
    pose = poses(robot, rng, 20)
    extra = inverse(robot, pose, t, sag=True)[0] - inverse(robot, pose, t)[0]
    d = pose[:, None, :3, 3] + robot.b @ pose[:, :3, :3].swapaxes(1, 2) - robot.a
    taut, u = run(d, Pulleys(r, UP))
    beta = np.arctan2(np.hypot(u[..., 0], u[..., 1]), u[..., 2])
    free = (taut - r * beta)[..., None] * u
    size, across, rise = taut - r * beta, np.hypot(free[..., 0], free[..., 1]), free[..., 2]
    parabola = (w * across) ** 2 * size / (24 * (t - w * rise / 2) ** 2)
    np.testing.assert_allclose(extra, parabola + e * w * rise * (size / 2 + r * beta), rtol=0.01, atol=1e-7)
    assert parabola.max() > 1e-5 and np.abs(extra - parabola).max() > 1e-6


def test_what_cannot_hang_over_a_pulley_says_so(rng):
    robot = heavy(box()).having(pulleys=wheels(rng), density=np.array([0.1] * 7 + [90.0]))
    with pytest.raises(ModelError, match="c8 cannot hang so"):
        inverse(robot, robot.home[None], 20.0, sag=True)
    inside = hang(np.array([0.1, 0.0, 0.01]), 50.0, 0.1, 0.0, Pulleys(np.array(0.1), UP))
    assert np.isnan(inside.length) and np.isnan(inside.gradient).all() and np.isnan(inside.wrap)
    assert np.isnan(hang(np.array([2.0, 0, 0]), 0.0, 0.1, 0.0, Pulleys(np.array(0.1), UP)).length)
    assert np.isnan(hang(np.array([2.0, 0, 0]), 0.0, 0.1, 0.0).length)
