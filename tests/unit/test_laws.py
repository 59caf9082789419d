"""The laws' own tests: what is right passes, what is wrong fails."""

from __future__ import annotations

import numpy as np
import pytest
from laws import check_jacobian, numeric_jacobian


def curve(x):
    return np.array([np.sin(x[0]) * x[1], np.exp(x[1]), x[0] * x[2] ** 2])


def slope(x):
    return np.array([[np.cos(x[0]) * x[1], np.sin(x[0]), 0], [0, np.exp(x[1]), 0], [x[2] ** 2, 0, 2 * x[0] * x[2]]])


X = np.array([0.3, -0.8, 1.7])


def test_differences_are_accurate():
    np.testing.assert_allclose(numeric_jacobian(curve, X), slope(X), atol=2e-11)


def test_a_right_jacobian_passes():
    check_jacobian(curve, slope, X)
    check_jacobian(lambda x: 3.0 * x[:2], lambda x: np.array([[3.0, 0, 0], [0, 3.0, 0]]), X)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda j: j * 1.0001,
        lambda j: -j,
        lambda j: j.T,
        lambda j: j + 1e-6,
        lambda j: j[:, :2],
        lambda j: np.where(j == j.max(), np.nan, j),
        lambda j: np.zeros_like(j),
    ],
)
def test_a_wrong_jacobian_fails(spoil):
    with pytest.raises(AssertionError):
        check_jacobian(curve, lambda x: spoil(slope(x)), X)


def test_a_comparison_that_cannot_fail_fails():
    with pytest.raises(AssertionError, match="unseen"):
        check_jacobian(curve, slope, X, tolerance=1.0)
