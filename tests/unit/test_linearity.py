"""How linear a problem is, against problems whose second order is known."""

from __future__ import annotations

import numpy as np
import pytest
from sizes import size
from unit.arm_data import arm, measured, true_arm
from unit.plain_terms import Plain, linear, plain_problem

from robocal.estimate import linearity
from robocal.estimate.least_squares import least_squares
from robocal.estimate.linearity import curvature, one_step
from robocal.estimate.uncertainty import uncertainty
from robocal.fit.options import Options
from robocal.prove.identify import identify
from robocal.remarks.code import Code


def test_a_linear_problem_keeps_what_it_promises(rng):
    p = plain_problem(linear(rng.normal(size=(20, 3)), rng.normal(size=20), sigma=0.5), np.ones(3))
    step = one_step(p, p.start)
    least = least_squares(p)
    left = np.sqrt(np.mean(p.residuals(least.x)[0].value ** 2))
    assert step.promised == pytest.approx(left) == step.left and step.neglected < 1e-12 and step.share < 1e-12
    assert step.before > step.promised and step.noise == pytest.approx(0.5)
    assert curvature(p, least.x, uncertainty(p, least.x).covariance).value < 1e-10


def quadratic(c, sigma=1.0):
    """r = x + c x^2 - 1 and a second row that sees nothing of it: the second order is c x^2 exactly."""
    return plain_problem(
        Plain(
            lambda x: np.array([[x[0] + c * x[0] ** 2 - 1], [0.0]]),
            lambda x: np.array([[[1 + 2 * c * x[0]]], [[0.0]]]),
            (2, 1),
            sigma=sigma,
        ),
        [0.0],
    )


@pytest.mark.parametrize("c", [0.01, 0.3])
def test_what_is_neglected_is_the_second_order(c):
    step = one_step(quadratic(c), np.zeros((1, 1)))
    # From zero the step is 1, so c is neglected in one row of two.
    assert step.neglected == pytest.approx(c / np.sqrt(2)) == step.left and step.share == pytest.approx(c)
    assert step.promised == pytest.approx(0, abs=1e-12) and step.before == pytest.approx(1 / np.sqrt(2))


def test_curvature_is_that_of_bates_and_watts():
    p = quadratic(0.2, sigma=0.5)
    x = least_squares(p).x
    slope = 1 + 2 * 0.2 * x[0, 0]
    found = curvature(p, x, uncertainty(p, x).covariance)
    # |r''| / |r'|^2, whitened: 2 c / sigma over (slope / sigma)^2.
    assert found.value == pytest.approx(2 * 0.2 * 0.5 / slope**2) and found.parameter == "b1"


def test_a_look_at_few_rows_finds_the_step_that_all_would(monkeypatch, rng):
    """No bound says so: rows and columns of sizes that differ by decades, some that bend along one column alone. Where the sizes of rows
    scatter by a whole decade one problem in two hundred would be told too small; here they scatter by six tenths of one."""
    few = linearity.LOOKS
    for _ in range(size(5000, 150)):
        m, n = int(rng.integers(600, 2500)), int(rng.integers(2, 12))
        a = rng.normal(size=(m, n)) * 10 ** rng.normal(0, 1, n)
        b = rng.normal(size=(m, n)) * 10 ** rng.normal(0, 0.6, (m, 1)) * 10 ** rng.normal(-3, 1, n)
        if rng.random() < 0.5:
            b *= rng.integers(0, n, (m, 1)) == np.arange(n)
        p = plain_problem(bent(a, b), np.zeros(n))
        told = []
        for looks in (few, ()):
            monkeypatch.setattr(linearity, "LOOKS", looks)
            told.append(curvature(p, p.start, np.linalg.inv(a.T @ a)))
        assert told[0].parameter == told[1].parameter and told[0].value == pytest.approx(told[1].value, rel=1e-9)


def bent(a, b):
    """r = A x + B x^2."""
    return Plain(lambda x: (a @ x + b @ x**2)[:, None], lambda x: (a + 2 * b * x)[:, None, :], (len(a), 1))


def test_local_blocks_and_other_units_have_none(rng):
    p = plain_problem(linear(np.eye(2), np.ones(2)), np.zeros(2))
    assert one_step(p, p.start, "rad") is None and one_step(p.with_free(()), p.start) is None


def test_a_robot_a_little_off_is_nearly_linear():
    found = identify(arm(), measured(40), Options(leave_one_out=False)).linearity
    assert not found.misleads and not found.ruins
    assert found.fitted.left < 1.5 * found.fitted.noise and found.curvature < 0.1


def test_a_robot_far_off_is_not_and_identify_says_so():
    far = true_arm(size=0.08)
    result = identify(arm(), measured(40, truth=far), Options(leave_one_out=False))
    assert result.linearity.misleads and any(w.code is Code.NOT_LINEAR for w in result.warnings)
    assert result.linearity.fitted.left > 20 * result.linearity.fitted.noise
    # The iteration did it all the same.
    assert result.stages[0].held_out.mean < 5 * result.groups[0].sigma


def test_wrong_weights_do_not_count(rng):
    """Rows without weight neither step nor tell."""
    a, y = rng.normal(size=(12, 2)), rng.normal(size=12)
    p = plain_problem(linear(a, y), np.zeros(2))
    some = np.ones((1, 12))
    some[0, 6:] = 0
    half = plain_problem(linear(a[:6], y[:6]), np.zeros(2))
    one, other = one_step(p.with_weights(some), p.start), one_step(half, half.start)
    assert one.promised == pytest.approx(other.promised) and one.left == pytest.approx(other.left)
