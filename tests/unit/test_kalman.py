"""The filter and least squares are one estimate where both are exact."""

from __future__ import annotations

import numpy as np
import pytest
from measure.scenarios import HAND, TRACKER, arm, build, made, observations
from unit.plain_terms import Plain, linear, plain_problem

from robocal.errors import ModelError
from robocal.estimate.kalman import kalman, stack_filter
from robocal.estimate.least_squares import least_squares
from robocal.estimate.uncertainty import uncertainty


def with_priors(p, sigma=None):
    return p.with_table(
        p.table.with_priors({n: float(p.scales[i]) if sigma is None else sigma for i, n in enumerate(p.free)})
    )


@pytest.mark.parametrize("passes", [1, 3])
def test_linear_filter_is_map(rng, passes):
    a, y, prior = rng.normal(size=(12, 5)), rng.normal(size=12), rng.uniform(0.2, 2, 5)
    p = plain_problem(
        linear(a, y, sigma=0.3, configuration=np.repeat(np.arange(4), 3)), rng.normal(size=5), prior=list(prior)
    )
    f = kalman(p, passes=passes)
    s = least_squares(p, cost_tolerance=1e-20)
    np.testing.assert_allclose(f.x, s.x, atol=1e-9)
    np.testing.assert_allclose(f.covariance, uncertainty(p, s.x).covariance, atol=1e-12)
    given = kalman(p, covariance=np.diag(prior**2))
    np.testing.assert_allclose(given.x, f.x, atol=1e-12)


def test_order_does_not_matter_when_linear(rng):
    a, y = rng.normal(size=(10, 3)), rng.normal(size=10)
    forward = kalman(plain_problem(linear(a, y), np.zeros(3)))
    backward = kalman(plain_problem(linear(a[::-1], y[::-1]), np.zeros(3)))
    np.testing.assert_allclose(forward.x, backward.x, atol=1e-10)
    np.testing.assert_allclose(forward.covariance, backward.covariance, atol=1e-13)


def test_configurations_without_rows_are_passed_over(rng):
    a, y = rng.normal(size=(4, 2)), rng.normal(size=4)
    events = []
    sparse = plain_problem(linear(a, y, configuration=np.array([1, 1, 4, 4])), np.zeros(2), configurations=6)
    f = kalman(sparse, watch=events.append)
    assert [e["configuration"] for e in events] == list(range(6)) and events[0]["configurations"] == 6
    np.testing.assert_allclose(f.x, kalman(plain_problem(linear(a, y), np.zeros(2))).x, atol=1e-10)


def test_iterated_update_is_gauss_newton(rng):
    """One unit with everything in it: the iterated filter converges to the MAP estimate of the nonlinear problem."""
    m = 10

    def value(x):
        return np.exp(np.outer(np.linspace(0, 1, m), x)).sum(axis=1)

    def jac(x):
        t = np.linspace(0, 1, m)
        return (t[:, None] * np.exp(np.outer(t, x)))[:, None, :]

    y = value(np.array([0.5, -1.0])) + 0.01 * rng.normal(size=m)
    term = Plain(lambda x: (value(x) - y)[:, None], jac, (m, 1), sigma=0.01, configuration=np.zeros(m, dtype=int))
    p = plain_problem(term, [0.2, -0.5], prior=[0.5, 0.5])
    s = least_squares(p, cost_tolerance=1e-20)
    once, often = kalman(p), kalman(p, passes=12)
    np.testing.assert_allclose(often.x, s.x, atol=1e-6)
    assert np.abs(once.x - s.x).max() > 10 * np.abs(often.x - s.x).max()


@pytest.mark.parametrize(("kind", "frame"), [("position", TRACKER), ("pose", HAND)])
def test_arm_filter_ends_near_least_squares(rng, kind, frame):
    p = with_priors(made(arm(), [observations(kind, 6, 1e-3, frame)], rng, 6, error=5e-4), 1e-3)
    s, f = least_squares(p), kalman(p, passes=4)
    sigma = np.sqrt(np.diag(f.covariance))
    assert (np.abs(p.difference(f.x) - p.difference(s.x))[0] < 0.3 * sigma).mean() > 0.9


def local_linear(rng, shared=3, m=4, size=6):
    """Each configuration has its own linear block; one row of each does not touch it and comes first."""
    rows = m * 8
    unit = np.repeat(np.arange(m), 8)
    local = np.where(np.arange(rows) % 8 == 0, -1, unit)
    block = rng.normal(size=(rows, 1, size))
    block[local < 0] = 0
    block[:, :, 3:] = 0  # the last three would be turned on the group
    a, y = rng.normal(size=(rows, 1, shared)), rng.normal(size=(rows, 1))
    term = Plain(lambda x: a @ x - y, lambda x: a, (rows, 1), configuration=unit, local=local, block=block)
    return (
        plain_problem(term, np.zeros(shared), blocks=m, block_size=size, prior=[0.7] * shared),
        a[:, 0],
        y[:, 0],
        block[:, 0],
        local,
    )


def test_local_blocks_enter_and_leave_with_their_configuration(rng):
    p, a, y, block, local = local_linear(rng)
    f = kalman(p, local_sigma=2.0)
    n, m = 3, 4
    dense = np.zeros((len(y), n + 3 * m))
    dense[:, :n] = a
    for i in np.flatnonzero(local >= 0):
        dense[i, n + 3 * local[i] : n + 3 * local[i] + 3] = block[i, :3]
    info = dense.T @ dense + np.diag([1 / 0.49] * n + [0.25] * (3 * m))
    x = np.linalg.solve(info, dense.T @ y)
    np.testing.assert_allclose(f.x[0, :n], x[:n], atol=1e-9)
    np.testing.assert_allclose(f.covariance, np.linalg.inv(info)[:n, :n], atol=1e-10)
    # The last block was updated with everything known; the earlier ones with what was known then.
    np.testing.assert_allclose(f.x[0, n:].reshape(m, 6)[-1, :3], x[n:].reshape(m, 3)[-1], atol=1e-9)


def test_a_block_seen_from_two_configurations_is_refused():
    with pytest.raises(ModelError, match="belong to one configuration"):
        kalman(build("pose/arm, targets eliminated"))


def test_two_blocks_in_one_configuration_are_refused(rng):
    block = rng.normal(size=(4, 1, 6))
    a = rng.normal(size=(4, 1, 2))
    term = Plain(
        lambda x: a @ x,
        lambda x: a,
        (4, 1),
        configuration=np.zeros(4, dtype=int),
        local=np.array([0, 0, 1, 1]),
        block=block,
    )
    with pytest.raises(ModelError, match="one local block"):
        kalman(plain_problem(term, np.zeros(2), blocks=2, block_size=6))


# --- vague priors, robust losses, bounds ------------------------------------------------------------------------------------


def test_a_vague_prior_costs_no_digits(rng):
    """Nine decades between what was expected and what the instrument says: the square-root form keeps them."""
    a, x = rng.normal(size=(30, 4)), rng.normal(size=4)
    p = plain_problem(linear(a, a @ x, sigma=1e-5), np.zeros(4))
    f = kalman(p, covariance=1e8 * np.eye(4))
    np.testing.assert_allclose(f.x[0], x, atol=1e-9)
    np.testing.assert_allclose(f.covariance, 1e-10 * np.linalg.inv(a.T @ a), rtol=1e-6)


def test_a_covariance_that_is_none_is_refused():
    with pytest.raises(ModelError, match="positive definite"):
        kalman(plain_problem(linear(np.eye(2), np.ones(2)), np.zeros(2)), covariance=np.diag([1.0, -1.0]))


@pytest.mark.parametrize("loss", ["huber", "cauchy", "tukey"])
def test_a_gross_row_hardly_moves_the_robust_filter(rng, loss):
    a, x = rng.normal(size=(40, 3)), rng.normal(size=3)
    y = a @ x + 0.01 * rng.normal(size=40)
    y[25] += 5.0
    p = plain_problem(linear(a, y, sigma=0.01), np.zeros(3), prior=[10.0] * 3)
    plain, robust = (np.linalg.norm(kalman(q).x[0] - x) for q in (p, p.with_loss(loss)))
    clean = np.linalg.norm(kalman(plain_problem(linear(np.delete(a, 25, 0), np.delete(y, 25), sigma=0.01), np.zeros(3), prior=[10.0] * 3)).x[0] - x)  # fmt: skip
    assert robust < 2 * clean < 0.1 * plain


def test_bounds_are_kept_and_the_rest_is_the_best_within_them(rng):
    a, y = rng.normal(size=(20, 3)), rng.normal(size=20)
    free = plain_problem(linear(a, y, configuration=np.zeros(20, dtype=int)), np.zeros(3), prior=[5.0] * 3)
    limit = 0.5 * float(kalman(free).x[0, 1])
    low, high = ([-9.0, limit, -9.0], [9.0] * 3) if limit < 0 else ([-9.0] * 3, [9.0, limit, 9.0])
    p = plain_problem(
        linear(a, y, configuration=np.zeros(20, dtype=int)), np.zeros(3), prior=[5.0] * 3, lower=low, upper=high
    )
    f = kalman(p)
    assert f.x[0, 1] == pytest.approx(limit)
    np.testing.assert_allclose(f.x, least_squares(p, cost_tolerance=1e-20).x, atol=1e-7)


# --- the stacked recursion --------------------------------------------------------------------------------------------------


def test_one_stacked_pass_is_the_filter(rng):
    a, y = rng.normal(size=(12, 3)), rng.normal(size=12)
    p = plain_problem(linear(a, y, sigma=0.2), np.zeros(3))
    prior = np.diag([0.5, 1.0, 2.0])
    one, whole = stack_filter(p, covariance=0.5 * prior, process=0.5 * prior, passes=1), kalman(p, covariance=prior)
    np.testing.assert_allclose(one.x, whole.x, atol=1e-12)
    np.testing.assert_allclose(one.covariance, whole.covariance, atol=1e-12)


def test_stacked_noise_is_a_variance_per_whitened_row(rng):
    a, y = rng.normal(size=(12, 3)), rng.normal(size=12)
    wide, fine = (plain_problem(linear(a, y, sigma=s), np.zeros(3)) for s in (0.3, 0.1))
    args = {"covariance": np.eye(3), "process": 0.1 * np.eye(3), "passes": 4}
    for noise in (9.0, np.full(12, 9.0)):
        np.testing.assert_allclose(stack_filter(fine, noise=noise, **args).x, stack_filter(wide, **args).x, atol=1e-12)


def test_what_the_stacked_recursion_does_not_know_is_refused(rng):
    p = plain_problem(linear(np.eye(2), np.ones(2)), np.zeros(2))
    with pytest.raises(ModelError, match="robust loss or bounds"):
        stack_filter(p.with_loss("huber"), covariance=np.eye(2), process=np.eye(2))
