"""Covariance, degrees of freedom and bands against direct formulas, and against Monte Carlo on a small arm."""

from __future__ import annotations

import numpy as np
import pytest
from measure.scenarios import TRACKER, arm, build, configurations, observations
from scipy import stats
from unit.plain_terms import Plain, linear, plain_problem

from robocal.estimate.least_squares import least_squares
from robocal.estimate.uncertainty import band, uncertainty
from robocal.measure.base import problem, synthesise
from robocal.measure.data import DataSet


def test_covariance_is_the_inverse_information(rng):
    a, y = rng.normal(size=(30, 4)), rng.normal(size=30)
    sigma = rng.uniform(0.5, 2, 30)
    p = plain_problem(linear(a, y, sigma=sigma[:, None]), np.zeros(4))
    s = least_squares(p, cost_tolerance=1e-18)
    u = uncertainty(p, s.x)
    expected = np.linalg.inv((a / sigma[:, None] ** 2).T @ a)
    np.testing.assert_allclose(u.covariance, expected, rtol=1e-10, atol=1e-14)
    r = (a @ s.x[0] - y) / sigma
    assert u.chi2 == pytest.approx(r @ r) and u.dof == 26 and u.factor == max(1.0, np.sqrt(u.chi2 / 26))
    np.testing.assert_allclose(u.sigma_instrument, np.sqrt(np.diag(expected)))
    np.testing.assert_allclose(u.sigma, u.factor * u.sigma_instrument)
    np.testing.assert_allclose(np.diag(u.correlation), 1)
    assert u.correlation[0, 1] == pytest.approx(expected[0, 1] / np.sqrt(expected[0, 0] * expected[1, 1]))


@pytest.mark.parametrize(("size", "factor"), [(3.0, 3.0), (0.5, 1.0)])
def test_stated_noise_only_grows_and_estimated_noise_scales_both_ways(rng, size, factor):
    a = rng.normal(size=(4000, 3))
    p = plain_problem(linear(a, rng.normal(scale=size, size=4000)), np.zeros(3))
    x = least_squares(p).x
    assert uncertainty(p, x).factor == pytest.approx(factor, rel=0.05)
    assert uncertainty(p, x, estimated=True).factor == pytest.approx(size, rel=0.05)


def test_priors_add_rows_and_information(rng):
    a, y = rng.normal(size=(3, 4)), rng.normal(size=3)
    p = plain_problem(linear(a, y), np.zeros(4), prior=[0.1, None, 0.3, 0.2])
    s = least_squares(p, cost_tolerance=1e-18)
    u = uncertainty(p, s.x)
    info = np.array([1 / 0.01, 0, 1 / 0.09, 1 / 0.04])
    np.testing.assert_allclose(u.covariance, np.linalg.inv(a.T @ a + np.diag(info)), rtol=1e-9)
    assert u.dof == 3 + 3 - 4 and u.chi2 == pytest.approx(np.sum((a @ s.x[0] - y) ** 2) + s.x[0] ** 2 @ info)


def test_no_degree_of_freedom_left(rng):
    a = rng.normal(size=(3, 3))
    p = plain_problem(linear(a, rng.normal(size=3)), np.zeros(3))
    u = uncertainty(p, least_squares(p).x)
    assert u.dof == 0 and u.factor == 1.0
    assert uncertainty(p.with_free(()), p.start).covariance.shape == (0, 0)


def test_a_column_without_effect_is_as_uncertain_as_expected(rng):
    """A caller may keep everything: no crash, no sigma of zero, and no degree of freedom charged."""
    a = rng.normal(size=(20, 3))
    a = np.column_stack([a, np.zeros(20), a[:, 0]])
    p = plain_problem(linear(a, rng.normal(size=20)), np.zeros(5), expected=[0.5] * 5)
    u = uncertainty(p, least_squares(p).x)
    assert u.dof == 20 - 3 and np.isfinite(u.covariance).all() and np.isfinite(u.correlation).all()
    assert u.sigma_instrument[3] == pytest.approx(0.5)
    # b1 and b5 share what is known of their sum; their difference is known to 0.5 in its own direction.
    known = np.linalg.inv(a[:, :3].T @ a[:, :3])[0, 0]
    assert u.covariance[0, 0] == pytest.approx(known / 4 + 0.25 / 2, rel=1e-6)
    assert u.covariance[0, 0] + u.covariance[4, 4] + 2 * u.covariance[0, 4] == pytest.approx(known, rel=1e-6)


def test_local_blocks_cost_what_they_absorb(rng):
    """Poses seen by three numbers each absorb three, not six."""
    m, count = 12, 4
    local = np.repeat(np.arange(count), 3)
    block = rng.normal(size=(m, 1, 6))
    a = rng.normal(size=(m, 1, 2))
    p = plain_problem(
        Plain(lambda x: a @ x, lambda x: a, (m, 1), local=local, block=block, configuration=local),
        np.zeros(2),
        blocks=count,
        block_size=6,
    )
    u = uncertainty(p.with_free(()), p.start)
    assert u.dof == 0
    full = build("lengths/free poses")
    lin = full.linearize(full.start)
    u = uncertainty(full.with_free(["c1.l0"]), full.start)
    assert u.dof == max(len(lin.r) - 5 * 4, 0)


@pytest.mark.parametrize("name", ["pose/arm, targets eliminated", "pixels/arm, markers eliminated"])
def test_covariance_with_blocks_is_that_of_the_dense_problem(name):
    p = build(name).with_free(["j2.alpha", "j3.d", "hand.x"])
    lin = p.linearize(p.start)
    dense = np.zeros((len(lin.r), p.n + 12))
    dense[:, : p.n] = lin.j
    for b in range(2):
        dense[lin.local == b, p.n + 6 * b : p.n + 6 * b + 6] = lin.jl[lin.local == b]
    u = uncertainty(p, p.start)
    np.testing.assert_allclose(u.covariance, np.linalg.inv(dense.T @ dense)[: p.n, : p.n], rtol=1e-6)
    assert u.dof == len(lin.r) - p.n - 12


def test_band_is_the_trace(rng):
    j, c = rng.normal(size=(5, 3, 4)), rng.normal(size=(4, 4))
    c = c @ c.T
    np.testing.assert_allclose(band(j, c), [np.sqrt(np.trace(k @ c @ k.T)) for k in j])
    assert (band(j, np.zeros((4, 4))) == 0).all()


# --- Monte Carlo ------------------------------------------------------------------------------------------------------------

FREE = (
    "j2.alpha",
    "j2.theta",
    "j3.d",
    "j3.beta",
    "j4.theta",
    "tracker.x",
    "tracker.y",
    "tracker.z",
    "tracker.rx",
    "tracker.ry",
    "tracker.rz",
)


def trials(count, m=12, sigma=5e-5, prior=None):
    """`count` noisy copies of one experiment as one batch; truth is the table's value."""
    rng = np.random.default_rng(42)
    robot = arm()
    where = configurations(robot, rng, m)
    clean = synthesise(robot, DataSet(where, (observations("position", m, sigma, TRACKER),)))
    obs = clean.observations[0]
    noisy = obs.value + obs.sigma * rng.standard_normal((count, m, 3))
    p = problem(robot, DataSet(where, (obs.__class__(**{**obs.__dict__, "value": noisy}),)), free=FREE)
    return p, problem(robot, clean, free=FREE)


def check_spread(count):
    p, clean = trials(count)
    s = least_squares(p, np.repeat(p.start, count, axis=0))
    assert all(r.converged for r in s.reasons)
    u = uncertainty(clean, clean.start)
    step = clean.difference(s.x)
    error = 1 / np.sqrt(2 * count)  # relative, of a standard deviation
    ratio = step.std(axis=0) / u.sigma_instrument
    print(f"spread over predicted: {np.round(ratio, 4)}, Monte Carlo error {error:.4f}")
    assert (np.abs(ratio - 1) < 4.5 * error).all()
    # The whole covariance at once: d^T C^-1 d is chi squared with n degrees of freedom.
    z = np.einsum("bi,ij,bj->b", step, np.linalg.inv(u.covariance), step)
    mean_error = np.sqrt(2 * p.n / count)
    print(f"mean of d' C^-1 d: {z.mean():.3f} for {p.n}, Monte Carlo error {mean_error:.3f}")
    assert abs(z.mean() - p.n) < 4.5 * mean_error
    bias = np.abs(step.mean(axis=0)) / u.sigma_instrument
    assert (bias < 4.5 / np.sqrt(count) + 0.01).all()
    dof = clean.linearize(clean.start).r.size - p.n
    chi2, chi_error = 2 * s.cost / dof, np.sqrt(2 / dof / count)
    print(f"chi2 / dof: {chi2.mean():.4f}, Monte Carlo error {chi_error:.4f}")
    assert abs(chi2.mean() - 1) < 4.5 * chi_error
    # Intervals of each trial with its own chi2 (Student's t): 95 % must cover.
    t = stats.t.isf(0.025, dof)
    inside = np.abs(step) <= t * np.sqrt(chi2)[:, None] * u.sigma_instrument
    known = np.abs(step) <= 1.959964 * u.sigma_instrument
    spread = np.sqrt(0.95 * 0.05 / count)
    print(f"coverage: {inside.mean(axis=0).round(4)}, {known.mean(axis=0).round(4)}, Monte Carlo error {spread:.4f}")
    for share in (inside.mean(axis=0), known.mean(axis=0)):
        assert (share > 0.95 - max(0.02, 4.5 * spread)).all() and (share < 0.95 + max(0.02, 4.5 * spread)).all()


def test_spread_equals_covariance_quickly():
    check_spread(800)


@pytest.mark.slow
def test_spread_equals_covariance_in_ten_thousand_trials():
    check_spread(10_000)
