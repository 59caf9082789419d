"""The solver: against SciPy, with bounds, priors, robust losses and local blocks; lock step; and why it stops."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.optimize
from unit.plain_terms import Plain, linear, plain_problem

from robocal.errors import Cancelled, ModelError
from robocal.estimate.least_squares import METHODS, Reason, least_squares
from robocal.estimate.problem import TUNING


def curved(rng, m=30, n=4, noise=0.05):
    """A smooth nonlinear fit y = sum_k x_k sin(a_ik x_k + c_ik) with its functions."""
    a, c = rng.uniform(0.2, 1, (m, n)), rng.uniform(-1, 1, (m, n))
    truth = rng.uniform(0.5, 1.5, n)

    def value(x):
        return (x * np.sin(a * x + c)).sum(axis=1)

    y = value(truth) + rng.normal(scale=noise, size=m)

    def fn(x):
        return (value(x) - y)[:, None]

    def jac(x):
        return (np.sin(a * x + c) + a * x * np.cos(a * x + c))[:, None, :]

    return truth, fn, jac


def scipy_solution(fn, jac, start, **more):
    return scipy.optimize.least_squares(
        lambda x: fn(x).ravel(), start, lambda x: jac(x).reshape(-1, len(x)), xtol=1e-14, ftol=1e-14, gtol=1e-14, **more
    )


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("method", ["lm", "gauss-newton", "pinv"])
def test_agrees_with_scipy(seed, method):
    rng = np.random.default_rng(seed)
    truth, fn, jac = curved(rng)
    start = truth + rng.normal(scale=0.1, size=4)
    s = least_squares(plain_problem(Plain(fn, jac, (30, 1)), start), method=method, cost_tolerance=1e-16)
    oracle = scipy_solution(fn, jac, start)
    assert s.reasons[0].converged
    np.testing.assert_allclose(s.x[0], oracle.x, atol=1e-6)
    np.testing.assert_allclose(s.cost[0], oracle.cost, rtol=1e-9)
    assert s.history[0, 0] == pytest.approx(0.5 * np.sum(fn(start) ** 2)) and s.history[-1, 0] <= s.history[0, 0]


def test_sigma_weights_the_rows(rng):
    a, y = rng.normal(size=(20, 3)), rng.normal(size=20)
    sigma = rng.uniform(0.1, 2, 20)
    s = least_squares(plain_problem(linear(a, y, sigma=sigma[:, None]), np.zeros(3)), cost_tolerance=1e-18)
    np.testing.assert_allclose(s.x[0], np.linalg.lstsq(a / sigma[:, None], y / sigma, rcond=None)[0], atol=1e-9)


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


# --- lock step --------------------------------------------------------------------------------------------------------------


def test_a_batch_is_its_singles_and_each_has_its_own_stop(rng):
    truth, fn, jac = curved(rng)
    p = plain_problem(Plain(fn, jac, (30, 1)), truth)
    best = least_squares(p, cost_tolerance=1e-16).x[0]
    starts = np.stack([best, truth + 0.3, truth - 0.2, truth + 0.05])
    together = least_squares(p, starts)
    for b, start in enumerate(starts):
        alone = least_squares(p, start)
        np.testing.assert_allclose(together.x[b], alone.x[0], atol=1e-9)
        assert together.iterations[b] == alone.iterations[0] and together.reason[b] == alone.reason[0]
    assert len(set(together.iterations.tolist())) > 1 and together.iterations[0] <= 2
    assert len(together.history) == together.iterations.max() + 1
    settled = together.history[int(together.iterations[0]) :, 0]
    assert (settled == settled[0]).all(), "a problem that has stopped stays where it is"


def test_weights_make_a_batch_of_subsets(rng):
    truth, fn, jac = curved(rng)
    p = plain_problem(Plain(fn, jac, (30, 1)), truth)
    weights = rng.integers(0, 3, (5, 30)).astype(float)
    together = least_squares(p.with_weights(weights), np.repeat(truth[None], 5, axis=0), cost_tolerance=1e-16)
    for b in range(5):
        root = np.sqrt(weights[b])[:, None]
        oracle = scipy_solution(lambda x, w=root: w * fn(x), lambda x, w=root: w[:, :, None] * jac(x), truth)
        np.testing.assert_allclose(together.x[b], oracle.x, atol=1e-6)


# --- reasons ----------------------------------------------------------------------------------------------------------------


def test_a_start_without_residual_stops_at_once(rng):
    a, x = rng.normal(size=(6, 3)), rng.normal(size=3)
    s = least_squares(plain_problem(Plain(lambda v: (a @ (v - x))[:, None], lambda v: a[:, None, :], (6, 1)), x))
    assert s.reasons == (Reason.GRADIENT,) and s.iterations[0] == 0 and s.reasons[0].converged


def test_consistent_data_are_solved_to_rounding_and_called_converged(rng):
    truth, fn, jac = curved(rng, noise=0.0)
    s = least_squares(plain_problem(Plain(fn, jac, (30, 1)), truth + 0.1))
    assert s.reasons[0].converged and s.cost[0] < 1e-25
    np.testing.assert_allclose(s.x[0], truth, atol=1e-12)


def test_not_finite(rng):
    a = rng.normal(size=(6, 2))
    p = plain_problem(
        Plain(lambda v: (a @ v)[:, None] + np.where(v[0] > 1, np.nan, 0.0), lambda v: a[:, None, :], (6, 1)), [2.0, 0.0]
    )
    for method in METHODS:
        s = least_squares(p, method=method)
        assert s.reasons == (Reason.NOT_FINITE,) and not s.reasons[0].converged
        np.testing.assert_array_equal(s.x, [[2.0, 0.0]])
    inside = least_squares(p, np.array([[2.0, 0.0], [0.5, 0.3]]))
    assert inside.reasons[0] == Reason.NOT_FINITE and inside.reasons[1].converged


def test_a_step_into_nowhere_is_refused_and_shortened():
    """log x from x = 3: the undamped step leads to a negative x, where the residual is not a number."""

    def fn(x):
        with np.errstate(invalid="ignore"):
            return np.log(x)[None]

    p = plain_problem(Plain(fn, lambda x: (1 / x)[None, None], (1, 1)), [3.0])
    s = least_squares(p)
    assert s.reasons[0].converged and s.x[0, 0] == pytest.approx(1.0)
    assert least_squares(p, method="gauss-newton").reasons == (Reason.STALLED,)


def test_gauss_newton_on_a_singular_problem(rng):
    a = rng.normal(size=(6, 2))
    a = np.column_stack([a, np.zeros(6)])
    p = plain_problem(linear(a, rng.normal(size=6)), np.zeros(3))
    assert least_squares(p, method="gauss-newton").reasons == (Reason.SINGULAR,)
    damped = least_squares(p)
    assert damped.reasons[0].converged and damped.x[0, 2] == 0, "a column without effect does not move"
    ones = np.array([[1.0, 1.0], [2.0, 2.0]])
    twice = plain_problem(linear(ones, np.array([1.0, 1.0])), np.zeros(2))
    assert least_squares(twice, method="gauss-newton").reasons == (Reason.SINGULAR,)
    lm = least_squares(twice)
    assert lm.reasons[0].converged and lm.x[0].sum() == pytest.approx(0.6)


def test_too_few_iterations(rng):
    truth, fn, jac = curved(rng)
    p = plain_problem(Plain(fn, jac, (30, 1)), truth + 0.3)
    s = least_squares(p, max_iterations=1)
    assert s.reasons == (Reason.ITERATIONS,) and s.iterations[0] == 1 and not s.reasons[0].converged
    assert s.cost[0] < s.history[0, 0]


def test_stalled_where_the_gradient_lies():
    """A Jacobian of the wrong sign promises what no step can keep."""
    p = plain_problem(Plain(lambda x: (x + 1)[None], lambda x: -np.ones((1, 1, 1)), (1, 1)), [1.0])
    assert least_squares(p).reasons == (Reason.STALLED,)


def test_nothing_free_is_solved_already(rng):
    p = plain_problem(linear(rng.normal(size=(5, 2)), np.ones(5)), np.zeros(2)).with_free(())
    s = least_squares(p)
    assert s.reasons == (Reason.GRADIENT,) and s.x.shape == (1, 2)


def test_every_reason_has_words():
    assert all(r.text for r in Reason) and {r for r in Reason if r.converged} == {
        Reason.COST,
        Reason.GRADIENT,
        Reason.STEP,
    }


def test_an_unknown_method_and_an_unknown_name(rng):
    p = plain_problem(linear(np.eye(2), np.ones(2)), np.zeros(2))
    with pytest.raises(ModelError, match="did you mean 'lm'"):
        least_squares(p, method="lmm")
    with pytest.raises(ModelError, match="unknown parameter"):
        p.with_free(["b1", "b7"])


@pytest.mark.parametrize("method", ["lm", "pinv"])
def test_a_watcher_sees_every_iteration_and_may_stop(rng, method):
    truth, fn, jac = curved(rng)
    p = plain_problem(Plain(fn, jac, (30, 1)), truth + 0.2)
    seen = []
    least_squares(p, method=method, watch=seen.append)
    assert [e["stage"] for e in seen] == ["iterate"] * len(seen) and seen[-1]["cost"] < seen[0]["cost"]

    def stop(event):
        raise Cancelled

    with pytest.raises(Cancelled):
        least_squares(p, method=method, watch=stop)


# --- pinv and lse -----------------------------------------------------------------------------------------------------------


def test_pinv_gives_the_shortest_step_and_lse_takes_one(rng):
    a, y = rng.normal(size=(8, 3)), rng.normal(size=8)
    a = np.column_stack([a, a[:, 0] + a[:, 1]])
    expected = np.linalg.pinv(a) @ y
    for method in ("pinv", "lse"):
        s = least_squares(plain_problem(linear(a, y), np.zeros(4)), method=method)
        np.testing.assert_allclose(s.x[0], expected, atol=1e-9)
    truth, fn, jac = curved(rng)
    p = plain_problem(Plain(fn, jac, (30, 1)), truth + 0.1)
    one = least_squares(p, method="lse")
    j = jac(p.start[0])[:, 0]
    np.testing.assert_allclose(one.x[0], p.start[0] - np.linalg.pinv(j) @ fn(p.start[0])[:, 0], atol=1e-12)
    assert one.iterations[0] == 1


def test_pinv_does_not_call_divergence_convergence():
    """atan from 1.5: every Gauss-Newton step overshoots further."""
    p = plain_problem(Plain(lambda x: np.arctan(x)[None], lambda x: (1 / (1 + x**2))[None, None], (1, 1)), [1.5])
    s = least_squares(p, method="pinv", max_iterations=6)
    assert not s.reasons[0].converged, s.reasons
    good = least_squares(p, np.array([[1.0]]), method="pinv")
    assert good.reasons[0].converged and abs(good.x[0, 0]) < 1e-12
    assert least_squares(p).reasons[0].converged, "lm converges where Gauss-Newton does not"


def test_pinv_takes_one_problem_without_blocks(rng):
    p = plain_problem(linear(np.eye(2), np.ones(2)), np.zeros(2))
    with pytest.raises(ModelError, match="pseudo-inverse"):
        least_squares(p, np.zeros((2, 2)), method="pinv")


# --- local blocks -----------------------------------------------------------------------------------------------------------


def blocks_problem(rng, size, count=5, each=8, n=3):
    """Linear rows with shared and local columns, as a problem with blocks and as one dense matrix."""
    m = count * each
    a, y = rng.normal(size=(m, 2, n)), rng.normal(size=(m, 2))
    local = np.repeat(np.arange(count), each)
    block = np.zeros((m, 2, size))
    block[:, :, :3] = rng.normal(size=(m, 2, 3))
    term = Plain(lambda x: a @ x - y, lambda x: a, (m, 2), local=local, block=block, unit=local)
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
