"""Intervals, standard deviations and efficiency of the estimator on three robots, 10 000 trials each; every figure with
its own Monte Carlo error."""

from __future__ import annotations

import numpy as np
import pytest
from trials import ROBOTS, Experiment

from robocal.estimate.uncertainty import quantile, uncertainty

pytestmark = pytest.mark.slow
TRIALS = 10_000
FIRST = 2_000
SURE = 4.5  # standard deviations of chance that a bound allows for, on top of what the issue asks


@pytest.mark.parametrize("kind", ["position", "pose"])
@pytest.mark.parametrize("robot", ROBOTS)
def test_intervals_deviations_and_the_cramer_rao_bound(robot, kind):
    # A seed of its own for each, so that six experiments are six pieces of evidence.
    rig = Experiment(robot, kind, 50 if kind == "position" else 40, seed=10 * ROBOTS.index(robot) + len(kind))
    error, chi2 = rig.trials(TRIALS)
    predicted = uncertainty(rig.clean, rig.clean.start)
    n, dof = rig.clean.n, predicted.dof
    # 95 % intervals: sigma known, and sigma from the residuals of each trial (Student's t).
    known = np.abs(error) <= quantile() * predicted.sigma_instrument
    estimated = np.abs(error) <= quantile(dof) * np.sqrt(chi2 / dof)[:, None] * predicted.sigma_instrument
    for name, inside in (("sigma known", known), ("sigma estimated", estimated)):
        for count in (FIRST, TRIALS):
            share, chance = inside[:count].mean(axis=0), np.sqrt(0.95 * 0.05 / count)
            print(
                f"\n{robot} {kind}: {name}, {n} parameters, {count} trials: cover {share.min():.2%} to {share.max():.2%}, each +- {chance:.2%}"
            )
            assert (share > 0.93).all() and (share < 0.97).all()
    # Standard deviations.
    ratio, chance = error.std(axis=0, ddof=1) / predicted.sigma_instrument, 1 / np.sqrt(2 * TRIALS)
    print(f"{robot} {kind}: spread over predicted {ratio.min():.4f} to {ratio.max():.4f}, each +- {chance:.4f}")
    assert (np.abs(ratio - 1) < 0.05).all()
    # The bound: no unbiased estimator is better than the inverse of the information, and this one is as good.
    info = rig.information()
    bound = np.sqrt(np.diag(np.linalg.inv(info)))
    efficiency = error.std(axis=0, ddof=1) / bound
    whole = np.einsum("bi,ij,bj->b", error, info, error).mean() / n
    chance_whole = np.sqrt(2 / n / TRIALS)
    print(
        f"{robot} {kind}: spread over Cramer-Rao bound {efficiency.min():.4f} to {efficiency.max():.4f}; all together {whole:.4f} +- {chance_whole:.4f}"
    )
    assert (np.abs(efficiency - 1) < 0.05).all() and abs(whole - 1) < 0.05
    bias = np.abs(error.mean(axis=0)) / predicted.sigma_instrument
    print(
        f"{robot} {kind}: bias at most {bias.max():.4f} sigma, each +- {1 / np.sqrt(TRIALS):.4f}; chi2/dof {chi2.mean() / dof:.4f} +- {np.sqrt(2 / dof / TRIALS):.4f}"
    )
    assert bias.max() < 0.05
    assert abs(chi2.mean() / dof - 1) < SURE * np.sqrt(2 / dof / TRIALS) + 1e-3


def test_the_yardstick_can_fail():
    """Noise 8 % larger than stated is noticed by every one of these figures."""
    rig = Experiment("rv-2aj", "position", 50)
    error, _ = rig.trials(4 * FIRST)
    predicted = uncertainty(rig.clean, rig.clean.start).sigma_instrument / 1.08
    assert (np.abs(error.std(axis=0) / predicted - 1) > 0.05).mean() > 0.9
    assert ((np.abs(error) <= quantile() * predicted).mean(axis=0) < 0.95).all()
