"""Where an estimate stood on its way: what is kept is what a shorter run ends with."""

from __future__ import annotations

import numpy as np
import pytest
from unit.plain_terms import Plain, curved, linear, plain_problem

from robocal.estimate.kalman import kalman, stack_filter
from robocal.estimate.least_squares import least_squares
from robocal.estimate.trail import Trail
from robocal.estimate.uncertainty import uncertainty


def test_even_steps_are_kept_of_a_long_way():
    trail = Trail(5, first=(np.zeros(1),))
    for count in range(100):
        trail.add(count, np.full(1, count + 1.0))
    trail.add(100, np.full(1, 101.0), last=True)
    assert len(trail.at) <= 6 and trail.at[0] == 0 and trail.at[-1] == 101 and len(set(np.diff(trail.at[:-1]))) == 1
    assert [float(x[0]) for x in trail.x] == trail.at


@pytest.mark.parametrize("method", ["lm", "gauss-newton", "pinv"])
def test_each_pass_is_where_a_shorter_run_ends(method):
    """From so far that steps of lm fail, and are taken back."""
    rng = np.random.default_rng(5)
    truth, fn, jac = curved(rng)
    far = 0.8 if method == "lm" else 0.1
    p, trail = plain_problem(Plain(fn, jac, (30, 1)), truth + far * rng.normal(size=4)), Trail()
    whole = least_squares(p, method=method, trail=trail)
    assert trail.at == list(range(len(whole.history))) and len(trail.at) > 3
    for count, x in zip(trail.at[2:], trail.x[2:], strict=True):
        shorter = least_squares(p, method=method, max_iterations=count, trail=(again := Trail()))
        np.testing.assert_allclose(x, again.x[-1], rtol=1e-12)
        assert method == "pinv" or np.array_equal(again.x[-1], shorter.x[0])
    costs = [0.5 * np.sum(fn(x) ** 2) for x in trail.x]
    np.testing.assert_allclose(costs, whole.history[:, 0], rtol=1e-9)


def test_after_each_configuration_a_filter_knows_what_its_rows_say(rng):
    a, y, unit = rng.normal(size=(18, 3)), rng.normal(size=18), np.repeat(np.arange(6), 3)
    p, trail = plain_problem(linear(a, y, configuration=unit), np.zeros(3), prior=[0.7] * 3), Trail()
    whole = kalman(p, trail=trail)
    assert trail.at == list(range(7))
    for count, x, covariance in zip(trail.at[1:], trail.x[1:], trail.covariance[1:], strict=True):
        some = p.with_weights((np.arange(6) < count).astype(float)[None])
        np.testing.assert_allclose(x, least_squares(some, cost_tolerance=1e-20).x[0], atol=1e-9)
        np.testing.assert_allclose(covariance, uncertainty(some, x[None]).covariance, atol=1e-12)
    np.testing.assert_allclose(trail.covariance[-1], whole.covariance)


def test_of_many_configurations_some_are_kept_and_the_last(rng):
    p, trail = plain_problem(linear(rng.normal(size=(97, 2)), rng.normal(size=97)), np.zeros(2)), Trail(20)
    whole = kalman(p, trail=trail)
    assert len(trail.at) == len(trail.covariance) <= 21 and trail.at[-1] == 97
    np.testing.assert_array_equal(trail.x[-1], whole.x[0])


def test_the_stacked_filter_keeps_its_passes(rng):
    p, trail = plain_problem(linear(rng.normal(size=(9, 2)), rng.normal(size=9)), np.zeros(2)), Trail()
    ended = stack_filter(p, covariance=np.eye(2), process=np.eye(2), passes=5, trail=trail)
    assert trail.at == list(range(6))
    np.testing.assert_array_equal(trail.x[-1], ended.x[0])
