"""The error model of a calibration: against the dense system of the thesis, against refitting, and its exact facts."""

from __future__ import annotations

import numpy as np
import pytest
from cables.cable_robots import poses, published
from cables.test_calibration import attached, listed, made, read

from robocal.cables.calibration.per_cable import per_cable
from robocal.cables.calibration.propagation import ErrorPropagation, Noise, Requirement, rms
from robocal.errors import ModelError
from robocal.geometry import so3

FIGURE_3_8 = Noise(3e-3, 2e-3, np.deg2rad(1.0))


def dense(robot, t, lengths, places, turns):
    """dx of (3.63), D and K assembled row by row as (3.46) and (3.60) print them, with the rotation vector for r: (m, 4), zero first."""
    n, m = len(t), len(robot.cables)
    d, k, y = np.zeros((n * m, 4 * m)), np.zeros((n * m, n * (m + 6))), np.zeros(n * (m + 6))
    s = attached(robot, t)
    for j in range(n):
        y[j * (m + 6) : (j + 1) * (m + 6)] = np.concatenate([lengths[j], places[j], turns[j]])
        q = t[j, :3, :3]
        # dQ = [dr x] Q, column by column.
        turned = np.concatenate([-so3.skew(q[:, i]) for i in range(3)])
        for i in range(m):
            c = s[j, i] - robot.a[i]
            rho = np.linalg.norm(c)
            b = np.concatenate([robot.b[i, p] * np.eye(3) for p in range(3)], axis=1)
            row = j * m + i
            d[row, 4 * i : 4 * i + 4] = [rho, *c]
            at = j * (m + 6)
            k[row, at + i] = -rho
            k[row, at + m : at + m + 3] = c
            k[row, at + m + 3 : at + m + 6] = c @ b @ turned
    return np.linalg.lstsq(d, k @ y, rcond=None)[0].reshape(m, 4)


def test_the_form_by_cable_is_the_dense_one():
    rng = np.random.default_rng(0)
    for seed in range(5):
        robot = made(seed, 8)
        t = poses(robot, rng, 30)
        e = 1e-3 * rng.normal(size=(30, 8)), 1e-3 * rng.normal(size=(30, 3)), 1e-2 * rng.normal(size=(30, 3))
        anchors, zeros = ErrorPropagation(robot, t).propagate(lengths=e[0], places=e[1], turns=e[2], squared=True)
        x = dense(robot, t, *e)
        assert np.abs(anchors - x[:, 1:]).max() < 1e-9 and np.abs(zeros - x[:, 0]).max() < 1e-9


@pytest.mark.parametrize("squared", [False, True])
def test_a_constant_bias_moves_one_thing_only(squared):
    robot = made(1, 8)
    t = poses(robot, np.random.default_rng(1), 40)
    design = ErrorPropagation(robot, t)
    anchors, zeros = design.propagate(lengths=2e-3, squared=squared)
    assert np.abs(anchors).max() < 1e-9 and np.abs(zeros + 2e-3).max() < 1e-9
    shift = np.array([1e-3, -2e-3, 3e-3])
    anchors, zeros = design.propagate(places=np.broadcast_to(shift, (40, 3)), squared=squared)
    assert np.abs(anchors - shift).max() < 1e-9 and np.abs(zeros).max() < 1e-9
    # And so do the fits themselves.
    residual = "squared" if squared else "length"
    start = np.column_stack([robot.a, robot.zeros])
    found = per_cable(robot, t, read(robot, t) + 2e-3, residual=residual, start=start)
    assert np.abs(found.anchors - robot.a).max() < 1e-9 and np.abs(found.zeros - robot.zeros + 2e-3).max() < 1e-9
    moved = t.copy()
    moved[:, :3, 3] += shift
    found = per_cable(robot, moved, read(robot, t), residual=residual)
    assert np.abs(found.anchors - robot.a - shift).max() < 1e-9 and np.abs(found.zeros - robot.zeros).max() < 1e-9


@pytest.mark.parametrize("degrees", ["3R3T", "1R2T", "2T", "3T"])
@pytest.mark.parametrize("squared", [False, True])
def test_small_errors_move_a_fit_as_foretold(degrees, squared):
    rng = np.random.default_rng(2)
    robot = made(2, 8 if degrees == "3R3T" else 4, degrees)
    t = listed(robot, rng, 40)
    e, v, w = (1e-7 * rng.normal(size=(40, k)) for k in (len(robot.cables), 3, 3))
    some = [[i - s for i in robot.axes if s <= i < s + 3] for s in (0, 3)]
    v[:, [i for i in range(3) if i not in some[0]]] = 0.0
    w[:, [i for i in range(3) if i not in some[1]]] = 0.0
    noisy = t.copy()
    noisy[:, :3, 3] += v
    noisy[:, :3, :3] = so3.exp(w) @ t[:, :3, :3]
    found = per_cable(robot, noisy, read(robot, t) + e, residual="squared" if squared else "length")
    anchors, zeros = ErrorPropagation(robot, t).propagate(lengths=e, places=v, turns=w, squared=squared)
    assert np.abs(found.anchors[0] - robot.a - anchors).max() < 1e-9 and np.abs(anchors).max() > 1e-7
    assert np.abs(found.zeros[0] - robot.zeros - zeros).max() < 1e-9


def drawn(robot, t, noise, batch, rng):
    """Poses as measured and readings, `batch` times."""
    n, m = len(t), len(robot.cables)
    y = read(robot, t) + noise.length * rng.normal(size=(batch, n, m))
    seen = np.tile(t, (batch, 1, 1, 1))
    seen[..., :3, 3] += noise.position * rng.normal(size=(batch, n, 3))
    seen[..., :3, :3] = so3.exp(noise.orientation * rng.normal(size=(batch, n, 3))) @ seen[..., :3, :3]
    return seen, y


@pytest.mark.parametrize("noise", [Noise(3e-3), FIGURE_3_8], ids=["3.7", "3.8"])
def test_the_covariance_is_that_of_draws(noise):
    """Cables share the errors of poses: across cables too."""
    robot = published("laval")
    rng = np.random.default_rng(3)
    t = poses(robot, rng, 100)
    seen, y = drawn(robot, t, noise, 2000, rng)
    found = per_cable(robot, seen, y)
    e = np.concatenate([found.anchors - robot.a, (found.zeros - robot.zeros)[..., None]], axis=-1).reshape(2000, -1)
    cov = ErrorPropagation(robot, t).covariance(noise)
    sigma = np.sqrt(np.diag(cov))
    assert np.abs(e.std(axis=0) / sigma - 1).max() < 0.08
    drawn_correlation = np.corrcoef(e.T)
    assert np.abs(drawn_correlation - cov / np.outer(sigma, sigma)).max() < 0.12
    assert np.abs(e.mean(axis=0) / sigma).max() < 0.12
    expected = ErrorPropagation(robot, t).rms_errors(cov)
    assert rms(e.reshape(-1, 8, 4)[..., :3], e.reshape(-1, 8, 4)[..., 3]) == pytest.approx(expected, rel=0.03)


@pytest.mark.parametrize("noise", [Noise(3e-3), FIGURE_3_8], ids=["3.7", "3.8"])
def test_squares_err_as_foretold(noise):
    robot = published("laval")
    rng = np.random.default_rng(4)
    t = poses(robot, rng, 800)
    seen, y = drawn(robot, t, noise, 400, rng)
    found = per_cable(robot, seen, y, residual="squared")
    bias = np.column_stack([found.anchors.mean(axis=0) - robot.a, found.zeros.mean(axis=0) - robot.zeros])
    anchors, zeros = ErrorPropagation(robot, t).bias_of_squares(noise)
    law = np.column_stack([anchors, zeros])
    scatter = np.concatenate([found.anchors, found.zeros[..., None]], axis=-1).std(axis=0) / 20
    # What the law leaves is smaller by the noise once more, and by the scatter of the mean.
    assert np.linalg.norm(bias - law) < 0.06 * np.linalg.norm(law) + 2 * np.linalg.norm(scatter)
    assert np.linalg.norm(law) > 10 * np.linalg.norm(scatter)
    # Inward: towards the poses.
    middle = t[:, :3, 3].mean(axis=0)
    assert (((middle - robot.a) * anchors).sum(axis=1) > 0).all()


def test_joint_weights_never_lose_and_gain_where_poses_err():
    robot = published("laval")
    t = poses(robot, np.random.default_rng(5), 100)
    design = ErrorPropagation(robot, t)
    alone, joint = design.covariance(FIGURE_3_8), design.bound(FIGURE_3_8)
    assert np.linalg.eigvalsh(alone - joint).min() > -1e-12
    assert design.rms_errors(joint)[0] < 0.85 * design.rms_errors(alone)[0]
    only = Noise(3e-3)
    assert design.rms_errors(design.bound(only)) == pytest.approx(design.rms_errors(design.covariance(only)), rel=1e-9)
    with pytest.raises(ModelError, match="without noise"):
        design.bound(Noise(0.0, 1e-3))


@pytest.mark.parametrize("estimator", ["maximum-likelihood", "per-cable"])
@pytest.mark.parametrize("what", ["anchors", "zeros", "position", "orientation"])
def test_what_is_required_gives_what_was_asked(estimator, what):
    robot = published("laval")
    t = poses(robot, np.random.default_rng(6), 60)
    needed = Requirement(ErrorPropagation(robot, t), FIGURE_3_8, estimator)
    asked = 0.8 * getattr(needed.rms_errors, what)
    f = needed.scale(what, asked)
    scaled = Noise(f * 3e-3, f * 2e-3, f * np.deg2rad(1.0))
    assert getattr(Requirement(ErrorPropagation(robot, t), scaled, estimator).rms_errors, what) == pytest.approx(
        asked, rel=1e-9
    )
    for name, value in needed.alone(what, asked).items():
        if value is not None and np.isfinite(value):
            one = Noise(**{**FIGURE_3_8.__dict__, name: value})
            got = getattr(Requirement(ErrorPropagation(robot, t), one, estimator).rms_errors, what)
            assert got == pytest.approx(asked, rel=1e-6)
    n = needed.poses(what, asked)
    assert n == int(np.ceil(60 / 0.64 - 1e-9))
    twice = Requirement(ErrorPropagation(robot, np.concatenate([t, t])), FIGURE_3_8, estimator)
    assert getattr(twice.rms_errors, what) * np.sqrt(2) == pytest.approx(getattr(needed.rms_errors, what), rel=1e-6)


def test_poses_after_a_calibration_err_as_foretold():
    """Calibrate, then ask where the platform is from lengths without noise."""
    from robocal.cables.forward import forward
    from robocal.cables.geometry import cable_robot

    robot = published("laval")
    rng = np.random.default_rng(7)
    t = poses(robot, rng, 100)
    noise = Noise(1e-3, 1e-3, np.deg2rad(0.2))
    seen, y = drawn(robot, t, noise, 60, rng)
    found = per_cable(robot, seen, y)
    exact = read(robot, t[:20])
    square = []
    for a, z in zip(found.anchors, found.zeros, strict=True):
        there = forward(cable_robot("found", a, robot.b, z), exact, start=t[:20]).pose
        turn = so3.log(there[:, :3, :3] @ np.swapaxes(t[:20, :3, :3], 1, 2))
        square.append([((there[:, :3, 3] - t[:20, :3, 3]) ** 2).sum(axis=1).mean(), (turn**2).sum(axis=1).mean()])
    got = np.sqrt(np.mean(square, axis=0))
    expected = Requirement(ErrorPropagation(robot, t), noise, "per-cable").rms_errors
    assert got == pytest.approx([expected.position, expected.orientation], rel=0.12)


def test_contours_are_lines_of_equal_error():
    robot = published("laval")
    t = poses(robot, np.random.default_rng(8), 60)
    needed = Requirement(ErrorPropagation(robot, t), FIGURE_3_8, "per-cable")
    curve = needed.contour("anchors", 5e-3, ("length", "orientation"))
    for a, b in curve[::9]:
        noise = Noise(length=float(a), orientation=float(b))
        assert Requirement(ErrorPropagation(robot, t), noise, "per-cable").rms_errors.anchors == pytest.approx(
            5e-3, rel=1e-6
        )


def test_nothing_is_required_of_nothing():
    robot = published("laval")
    design = ErrorPropagation(robot, poses(robot, np.random.default_rng(9), 20))
    with pytest.raises(ModelError, match="no noise"):
        _ = Requirement(design, Noise()).rms_errors
    with pytest.raises(ModelError, match="unknown estimator"):
        Requirement(design, FIGURE_3_8, "kalman")
    with pytest.raises(ModelError, match="no such error"):
        Requirement(design, FIGURE_3_8).scale("anchor", 1e-3)
