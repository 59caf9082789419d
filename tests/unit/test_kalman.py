"""The filter and least squares are one estimate where both are exact."""

from __future__ import annotations

import numpy as np
import pytest
from measure.scenarios import HAND, TRACKER, arm, build, made, observations
from unit.plain_terms import Plain, linear, plain_problem

from robocal.errors import ModelError
from robocal.estimate.kalman import kalman
from robocal.estimate.least_squares import least_squares
from robocal.estimate.uncertainty import uncertainty


def with_priors(p, sigma=None):
    return p.with_table(
        p.table.with_priors({n: float(p.scales[i]) if sigma is None else sigma for i, n in enumerate(p.free)})
    )


@pytest.mark.parametrize("passes", [1, 3])
def test_linear_filter_is_map(rng, passes):
    a, y, prior = rng.normal(size=(12, 5)), rng.normal(size=12), rng.uniform(0.2, 2, 5)
    p = plain_problem(linear(a, y, sigma=0.3, unit=np.repeat(np.arange(4), 3)), rng.normal(size=5), prior=list(prior))
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


def test_units_without_rows_are_passed_over(rng):
    a, y = rng.normal(size=(4, 2)), rng.normal(size=4)
    events = []
    sparse = plain_problem(linear(a, y, unit=np.array([1, 1, 4, 4])), np.zeros(2), units=6)
    f = kalman(sparse, watch=events.append)
    assert [e["unit"] for e in events] == list(range(6)) and events[0]["units"] == 6
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
    term = Plain(lambda x: (value(x) - y)[:, None], jac, (m, 1), sigma=0.01, unit=np.zeros(m, dtype=int))
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
    term = Plain(lambda x: a @ x - y, lambda x: a, (rows, 1), unit=unit, local=local, block=block)
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
        lambda x: a @ x, lambda x: a, (4, 1), unit=np.zeros(4, dtype=int), local=np.array([0, 0, 1, 1]), block=block
    )
    with pytest.raises(ModelError, match="one local block"):
        kalman(plain_problem(term, np.zeros(2), blocks=2, block_size=6))
