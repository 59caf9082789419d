"""The solver with bounds, priors, robust losses and local blocks, against SciPy and dense algebra."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.optimize
from unit.plain_terms import Plain, curved, linear, plain_problem, scipy_solution

from robocal.errors import ModelError
from robocal.estimate.least_squares import least_squares
from robocal.estimate.losses import TUNING

# --- bounds -----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(10))
def test_linear_bounds_equal_lsq_linear(seed):
    rng = np.random.default_rng(seed)
    a, y = rng.normal(size=(15, 5)), rng.normal(size=15)
    lower, upper = -rng.uniform(0, 0.2, 5), rng.uniform(0, 0.2, 5)
    p = plain_problem(linear(a, y), np.zeros(5), lower=list(lower), upper=list(upper))
    s = least_squares(p, cost_tolerance=1e-18)
    oracle = scipy.optimize.lsq_linear(a, y, (lower, upper), tol=1e-14)
    assert s.reasons[0].converged and (np.abs(oracle.active_mask).sum() > 0 or seed)
    np.testing.assert_allclose(s.cost[0], oracle.cost, rtol=1e-9)
    np.testing.assert_allclose(s.x[0], oracle.x, atol=1e-6)
    assert (s.x[0] >= lower).all() and (s.x[0] <= upper).all()


@pytest.mark.parametrize("seed", range(6))
def test_nonlinear_bounds_equal_trf(seed):
    rng = np.random.default_rng(seed)
    truth, fn, jac = curved(rng)
    upper = truth + np.where(np.arange(4) % 2, np.inf, -0.05)
    start = np.minimum(truth, upper) - 0.1
    p = plain_problem(Plain(fn, jac, (30, 1)), start, upper=list(upper), lower=[-5.0] * 4)
    s = least_squares(p, cost_tolerance=1e-16)
    oracle = scipy_solution(fn, jac, start, bounds=([-5.0] * 4, upper), method="trf")
    assert (s.x[0] == upper).any(), "an active bound was meant"
    np.testing.assert_allclose(s.cost[0], oracle.cost, rtol=1e-6)
    np.testing.assert_allclose(s.x[0], oracle.x, atol=1e-4)


def test_a_start_outside_its_bounds_comes_inside(rng):
    a, y = rng.normal(size=(10, 2)), rng.normal(size=10)
    p = plain_problem(linear(a, y), [5.0, 0.0], upper=[1.0, 1.0], lower=[-1.0, -1.0])
    s = least_squares(p)
    assert (np.abs(s.x) <= 1).all()


# --- priors -----------------------------------------------------------------------------------------------------------------


def test_priors_are_more_rows(rng):
    a, y = rng.normal(size=(4, 5)), rng.normal(size=4)  # fewer rows than columns: the priors decide the rest
    mean, prior = rng.normal(size=5), rng.uniform(0.1, 1, 5)
    p = plain_problem(linear(a, y), mean, prior=list(prior))
    s = least_squares(p, rng.normal(size=5), cost_tolerance=1e-18)
    stacked = np.vstack([a, np.diag(1 / prior)])
    expected = np.linalg.lstsq(stacked, np.concatenate([y, mean / prior]), rcond=None)[0]
    np.testing.assert_allclose(s.x[0], expected, atol=1e-9)
    assert s.cost[0] == pytest.approx(0.5 * np.sum((stacked @ expected - np.concatenate([y, mean / prior])) ** 2))


# --- robust losses ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
@pytest.mark.parametrize("seed", range(4))
def test_robust_solution_is_scipys(loss, seed):
    rng = np.random.default_rng(seed)
    truth, fn, jac = curved(rng, m=60, noise=0.1)
    gross = rng.choice(60, 6, replace=False)

    def dirty(x):
        r = fn(x).copy()
        r[gross, 0] -= 3.0
        return r

    p = plain_problem(Plain(dirty, jac, (60, 1), sigma=0.1), truth).with_loss(loss)
    s = least_squares(p, cost_tolerance=1e-16, max_iterations=300)
    oracle = scipy_solution(lambda x: dirty(x) / 0.1, lambda x: jac(x) / 0.1, truth, loss=loss, f_scale=TUNING[loss])
    np.testing.assert_allclose(s.cost[0], oracle.cost, rtol=1e-8)
    np.testing.assert_allclose(s.x[0], oracle.x, atol=2e-5)
    plain = least_squares(p.with_loss("none"))
    assert np.abs(s.x[0] - truth).max() < 0.5 * np.abs(plain.x[0] - truth).max()


def test_tukey_is_its_own_reweighting(rng):
    m, d = 40, 2  # two numbers per observation share one weight
    a, truth = rng.normal(size=(m, d, 3)), rng.normal(size=3)
    y = a @ truth + rng.normal(scale=0.1, size=(m, d))
    y[:4] += 5.0
    y[5, 0] += 0.45
    p = plain_problem(Plain(lambda x: a @ x - y, lambda x: a, (m, d), sigma=0.1), truth).with_loss("tukey", 5.0)
    s = least_squares(p, cost_tolerance=1e-18, max_iterations=500)
    x = truth.copy()
    for _ in range(500):
        r = (a @ x - y) / 0.1
        w = np.maximum(1 - (r**2).sum(axis=1) / 25.0, 0) ** 2
        root = np.sqrt(w)[:, None]
        x = np.linalg.lstsq((root[:, :, None] * a).reshape(-1, 3), (root * y).ravel(), rcond=None)[0]
    np.testing.assert_allclose(s.x[0], x, atol=1e-7)
    assert (w[:4] == 0).all() and 0 < w[5] < 1


def test_an_unknown_loss_is_refused(rng):
    with pytest.raises(ModelError, match="unknown loss"):
        plain_problem(linear(np.eye(2), np.ones(2)), np.zeros(2)).with_loss("welsch")


# --- local blocks -----------------------------------------------------------------------------------------------------------


def blocks_problem(rng, size, count=5, each=8, n=3):
    """Linear rows with shared and local columns, as a problem with blocks and as one dense matrix."""
    m = count * each
    a, y = rng.normal(size=(m, 2, n)), rng.normal(size=(m, 2))
    local = np.repeat(np.arange(count), each)
    block = np.zeros((m, 2, size))
    block[:, :, :3] = rng.normal(size=(m, 2, 3))
    term = Plain(lambda x: a @ x - y, lambda x: a, (m, 2), local=local, block=block, configuration=local)
    start = np.zeros(count * size)
    p = plain_problem(term, np.zeros(n), blocks=count, block_size=size, local_start=start)
    dense = np.zeros((m, 2, n + 3 * count))
    dense[:, :, :n] = a
    for i in range(m):
        at = n + 3 * local[i]
        dense[i, :, at : at + 3] = block[i, :, :3]
    return p, dense.reshape(2 * m, -1), y.ravel()


@pytest.mark.parametrize("size", [3, 6])
def test_elimination_equals_the_dense_solution(rng, size):
    p, dense, y = blocks_problem(rng, size)
    x = np.linalg.lstsq(dense, y, rcond=None)[0]
    s = least_squares(p, cost_tolerance=1e-18)
    assert s.reasons[0].converged
    np.testing.assert_allclose(s.x[0, :3], x[:3], atol=1e-8)
    np.testing.assert_allclose(s.x[0, 3:].reshape(5, size)[:, :3].ravel(), x[3:], atol=1e-8)
    assert s.cost[0] == pytest.approx(0.5 * np.sum((dense @ x - y) ** 2), rel=1e-10)
    # A batch of two takes the same road.
    two = least_squares(p, np.repeat(p.start, 2, axis=0), cost_tolerance=1e-18)
    np.testing.assert_allclose(two.x[1], s.x[0], atol=1e-12)


def test_a_block_that_no_row_sees_stays(rng):
    p, _, _ = blocks_problem(rng, 6)
    s = least_squares(p.with_weights(np.array([0.0, 1, 1, 1, 1])), cost_tolerance=1e-18)
    assert s.reasons[0].converged
    np.testing.assert_array_equal(s.x[0, 3:9], 0)
    nothing = least_squares(p.with_weights(np.zeros(5)))
    assert nothing.reasons[0].converged and nothing.cost[0] == 0
