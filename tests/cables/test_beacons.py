"""Anchors from ranges between beacons: found exactly without noise, and off by what their covariance says with it."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.cables.calibration.beacons import anchors_of_ranges, gauge_of, into_gauge
from robocal.errors import ModelError

SKETCH = np.array([(x, y, z) for z in (2.9, 0.2) for x, y in ((2.4, 1.9), (-2.4, 1.9), (-2.4, -1.9), (2.4, -1.9))])


def truth(rng: np.random.Generator) -> np.ndarray:
    """Anchors 30 mm off the sketch, in the frame of the first three."""
    a = SKETCH + rng.normal(scale=0.03, size=SKETCH.shape)
    move = into_gauge(a, SKETCH)
    return a @ move[:3, :3].T + move[:3, 3]


def ranges_of(a: np.ndarray) -> np.ndarray:
    return np.linalg.norm(a[:, None] - a[None], axis=2)


def test_exact_ranges_give_the_anchors():
    a = truth(np.random.default_rng(0))
    found, covariance = anchors_of_ranges(ranges_of(a), SKETCH, 0.1)
    assert np.abs(found - a).max() < 1e-9
    held = gauge_of(SKETCH)
    assert held.sum() == 6 and not np.diag(covariance)[held.ravel()].any()
    assert np.abs((a - SKETCH)[held]).max() < 1e-12  # the frame is the sketch's


def test_errors_are_those_of_the_covariance():
    rng, chi2 = np.random.default_rng(1), []
    for _ in range(200):
        a = truth(rng)
        noisy = ranges_of(a) + rng.normal(scale=0.01, size=(8, 8))
        found, covariance = anchors_of_ranges(noisy, SKETCH, 0.01)
        free = ~gauge_of(SKETCH).ravel()
        e = (found - a).ravel()[free]
        chi2.append(e @ np.linalg.solve(covariance[np.ix_(free, free)], e) / free.sum())
    assert abs(np.mean(chi2) - 1) < 4 * np.sqrt(2 / 18 / 200)


def test_too_few_ranges_are_refused():
    some = np.full((8, 8), np.nan)
    some[:3] = ranges_of(SKETCH)[:3]
    with pytest.raises(ModelError):
        anchors_of_ranges(some, SKETCH, 0.1)
    with pytest.raises(ModelError):
        gauge_of(SKETCH @ np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]]))
