"""A lens that is known with a covariance: what a camera's pixels make of it is as far off as its new covariance says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from files.kind_samples import ARM, simulated

from robocal.estimate.least_squares import least_squares
from robocal.measure.base import problem, synthesise
from robocal.measure.data import DataSet

KNOWN = ("fx", "fy", "cx", "k1")
CORRELATION = np.array([[1, 0.995, 0, 0.2], [0.995, 1, 0, 0.2], [0, 0, 1, 0], [0.2, 0.2, 0, 1]])
SIGMA = np.diag([5.0, 5.0, 3.0, 4e-3])
TRIALS = 400


def test_the_prior_of_a_lens_is_worth_what_it_says():
    """The stated lens is drawn about the true one; nine poses, the camera's own place unknown."""
    spread, rng = SIGMA @ CORRELATION @ SIGMA, np.random.default_rng(1)
    base = simulated("pixels", 9)
    first = replace(base.observations[0], sigma=4 * base.observations[0].sigma)
    base = replace(base, observations=(first,))
    true, at = np.array(first.options["intrinsics"]), [0, 1, 2, 4]
    names = [f"lens.{s}" for s in KNOWN]
    square, inside = [], []
    for _ in range(TRIALS):
        stated = true.copy()
        stated[at] += np.linalg.cholesky(spread) @ rng.standard_normal(4)
        seen = synthesise(ARM, base, rng).observations[0]
        prior = {"intrinsics": tuple(stated), "free": KNOWN, "known": KNOWN, "covariance": tuple(map(tuple, spread))}
        data = DataSet(base.configurations, (replace(seen, options={**first.options, **prior}),))
        p = problem(ARM, data).with_free([*(f"camera.{s}" for s in ("x", "y", "z", "rx", "ry", "rz")), *names])
        x = least_squares(p).x
        lower = np.tril(p.normal(x).a[0])
        own = [p.free.index(n) for n in names]
        c = np.linalg.inv(lower + np.tril(lower, -1).T)[np.ix_(own, own)]
        off = x[0, [p.table.index[n] for n in names]] - true[at]
        square.append(off @ np.linalg.solve(c, off) / 4)
        inside.append(np.abs(off) < 1.96 * np.sqrt(np.diag(c)))
    assert (np.sqrt(np.diag(c)) < 0.9 * np.diag(SIGMA)).any()  # the pixels say more than was known
    assert abs(np.mean(square) - 1) < 4 * np.sqrt(2 / 4 / TRIALS), np.mean(square)
    assert abs(np.mean(inside) - 0.95) < 4 * np.sqrt(0.95 * 0.05 / TRIALS), np.mean(inside)
