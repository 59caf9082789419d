"""The solver: against SciPy, in lock step over a batch, and why it stops."""

from __future__ import annotations

import numpy as np
import pytest
from unit.plain_terms import Plain, curved, linear, plain_problem, scipy_solution

from robocal.errors import Cancelled, ModelError
from robocal.estimate import least_squares as module
from robocal.estimate.least_squares import METHODS, least_squares
from robocal.estimate.problem import Problem
from robocal.estimate.solution import Reason


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


@pytest.mark.parametrize("at_once", [1, module.AT_ONCE])
def test_of_rivals_one_far_behind_the_best_goes_no_further(monkeypatch, at_once):
    """x^2 from afar takes a step of half the way each time; beside a start that has ended it is not worth them all, whether both move
    together or one after the other."""
    monkeypatch.setattr(module, "AT_ONCE", at_once)
    flat = Plain(lambda x: np.array([[x[0] ** 2 + 1e-3]]), lambda x: np.array([[[2 * x[0]]]]), (1, 1))
    p, starts = plain_problem(flat, np.zeros(1)), np.array([[0.0], [1e6]])
    apart, together = least_squares(p, starts), least_squares(p, starts, rivals=True)
    assert apart.iterations[1] > module.PATIENCE and together.iterations[1] == module.PATIENCE
    assert together.reasons[1] is Reason.ITERATIONS and together.reasons[0].converged
    assert together.cost[0] == apart.cost[0] and together.cost[1] > module.WORSE * together.cost[0]
    near = least_squares(p, np.array([[0.0], [1e-3]]), rivals=True)
    assert near.reasons[1].converged


def test_of_a_crowd_of_rivals_none_goes_on_beside_a_better_one(rng, monkeypatch):
    """Starts that run into one another are one from there on; the best of them ends where it does alone."""
    truth, fn, jac = curved(rng, noise=1e-3)
    p, rows, normal = plain_problem(Plain(fn, jac, (30, 1)), truth), [], Problem.normal
    starts = truth + 0.1 * rng.normal(size=(module.CROWD + 4, len(truth)))

    def count(self, x, *more):
        rows[-1] += len(x)
        return normal(self, x, *more)

    monkeypatch.setattr(Problem, "normal", count)
    rows += [0]
    apart = least_squares(p, starts)
    rows += [0]
    together = least_squares(p, starts, rivals=True)
    assert rows[1] < rows[0]
    best = int(np.argmin(together.cost))
    assert together.settled(best) and together.cost[best] == pytest.approx(apart.cost.min(), rel=1e-9)


def test_a_last_step_that_is_trusted_ends_where_it_does(rng, monkeypatch):
    """Rounds of a batch end at the same numbers with fewer evaluations; where steps fail, every one is looked at."""
    truth, fn, jac = curved(rng, noise=1e-3)
    p = plain_problem(Plain(fn, jac, (30, 1)), truth).with_weights(1.0 - np.eye(30)[:6])
    asked, normal = [], Problem.normal

    def count(self, x, *more):
        asked[-1] += len(x)
        return normal(self, x, *more)

    monkeypatch.setattr(Problem, "normal", count)
    for away, fewer in ((0.01, True), (3.0, False)):
        start = np.repeat(truth[None] + away, 6, axis=0)
        asked += [0]
        looked = least_squares(p, start)
        asked += [0]
        trusted = least_squares(p, start, trust=True)
        assert (asked[-1] < asked[-2]) is fewer
        np.testing.assert_allclose(trusted.x, looked.x, rtol=1e-9)
        np.testing.assert_array_equal(trusted.reason, looked.reason)
        np.testing.assert_array_equal(trusted.iterations, looked.iterations)


@pytest.mark.parametrize("loss", ["none", "huber", "tukey"])
def test_a_batch_in_parts_is_the_batch(rng, monkeypatch, loss):
    """Weights and histories of each, one start that is no number; parts of two, of one."""
    truth, fn, jac = curved(rng)
    p = plain_problem(Plain(fn, jac, (30, 1), sigma=0.05), truth).with_loss(loss)
    p = p.with_weights((rng.random((5, 30)) > 0.1).astype(float))
    start = truth + 0.3 * rng.normal(size=(5, len(truth)))
    start[3] = np.nan
    with np.errstate(invalid="ignore"):
        whole = least_squares(p, start)
    for numbers in (2 * p.n**2, 1):
        monkeypatch.setattr(module, "AT_ONCE", numbers)
        with np.errstate(invalid="ignore"):
            parts = least_squares(p, start)
        for name in ("x", "cost", "iterations", "reason", "history"):
            np.testing.assert_array_equal(getattr(parts, name), getattr(whole, name), err_msg=name)
        np.testing.assert_array_equal(parts.normal.a, whole.normal.a)
    assert whole.reason[3] == Reason.NOT_FINITE


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
        Reason.FILTERED,
        Reason.TOLERANCE,
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


# --- data without noise -----------------------------------------------------------------------------------------------------


def test_a_column_of_rounding_stays_near(rng):
    """Where a parameter does nothing yet but for rounding, the start must not throw it away: here by 1e11 without a floor."""
    a, truth = rng.normal(size=(20, 3)), rng.normal(size=3)
    dust = 3e-17 * rng.normal(size=20)

    def fn(x):
        # The fourth acts through the first alone, which starts at zero.
        return (a @ (x[:3] - truth) + x[0] * (x[3] - 0.5) * a[:, 1] ** 2)[:, None]

    def jac(x):
        first = a[:, 0] + (x[3] - 0.5) * a[:, 1] ** 2
        return np.column_stack([first, a[:, 1], a[:, 2], x[0] * a[:, 1] ** 2 + dust])[:, None, :]

    s = least_squares(plain_problem(Plain(fn, jac, (20, 1)), np.zeros(4)))
    assert s.reasons[0].converged and s.cost[0] < 1e-25
    np.testing.assert_allclose(s.x[0], [*truth, 0.5], atol=1e-9)
