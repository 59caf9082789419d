"""The accuracy that an identification promises, against many simulated experiments."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sizes import size
from unit.arm_data import SIX, TOOL, TRACKER, arm, measured, true_arm

from robocal.fit.options import Options
from robocal.prove.identify import identify


def band_ratio(count, m=40):
    """Spread of predicted positions over experiments against the predicted band, in the tracker's frame."""
    robot = arm(free=("j2.theta", "j3.d", "j3.theta", "j4.d", "j5.theta", *TOOL))
    errors, bands = [], []
    for seed in range(count):
        truth = true_arm(seed=seed, names=robot.table.free, robot=robot)
        found = identify(
            robot, measured(m, seed=1000 + seed, truth=truth, sigma=1e-4), Options(hold_out=0.0, leave_one_out=False)
        )
        q = np.random.default_rng(seed).uniform(*robot.limits.T, (100, 5))
        from robocal.geometry import se3

        frame = se3.from_vector([found.table[f"tracker.{s}"].value for s in SIX])
        a = (frame @ found.corrected.pose(q))[:, :3, 3]
        b = (se3.from_vector(TRACKER.value) @ truth.pose(q))[:, :3, 3]
        errors.append(np.linalg.norm(a - b, axis=1))
        bands.append(found.band.mean)
    rms = np.sqrt(np.mean(np.square(errors)))
    return rms / np.mean(bands), 1 / np.sqrt(2 * count)


@pytest.mark.slow
def test_the_band_is_the_error_away_from_the_data():
    ratio, error = band_ratio(25)
    print(f"rms error over mean band {ratio:.3f}, Monte Carlo error {error:.3f}")
    assert 0.75 < ratio < 1.4


@pytest.mark.slow
def test_the_band_is_the_error_in_many_experiments():
    ratio, error = band_ratio(300)
    print(f"rms error over mean band {ratio:.3f}, Monte Carlo error {error:.3f}")
    # rms against mean: a band that varies over the space by a third lifts the ratio by about 5 %.
    assert 0.9 < ratio < 1.2


@pytest.mark.sampled(1)
@pytest.mark.parametrize(("common", "wider"), [(1e-4, True), (0.0, False)])
def test_errors_that_return_with_the_place_are_not_averaged_away(common, wider):
    """Thirty places, each visited four times, not in a row: what the model leaves is the same at every visit, and four
    visits know no more of it than one. Intervals that count rows would be half as wide as they must be."""
    away, ratio = [], []
    for seed in range(12):
        rng, truth = np.random.default_rng(seed), true_arm(seed=seed)
        data = measured(120, q=np.tile(rng.uniform(-1, 1, (30, 5)), (4, 1)), seed=seed, truth=truth, stated=False)
        obs = data.observations[0]
        value = obs.value + np.tile(rng.normal(0, common, (30, 3)), (4, 1))
        data = replace(data, observations=(replace(obs, value=value),))
        found = identify(arm(), data, Options(hold_out=0.0, leave_one_out=False))
        value = obs.value + rng.normal(0, common, (120, 3))
        loose = replace(data, observations=(replace(obs, value=value),))
        each = identify(arm(), loose, Options(hold_out=0.0, leave_one_out=False))
        independent = {p.name: p.sigma for p in each.parameters if p.status == "identified"}
        for p in found.parameters:
            if p.status == "identified" and p.name in truth.table:
                away.append((p.identified - truth.table[p.name].value) / p.sigma)
                ratio += [p.sigma / independent[p.name]] if p.name in independent else []
    rms = float(np.sqrt(np.mean(np.square(away))))
    print(f"errors over sigma {rms:.2f} rms, sigma {np.median(ratio):.2f} times that of independent rows")
    assert 0.75 < rms < 1.25
    assert 1.7 < np.median(ratio) < 2.2 if wider else 0.9 < np.median(ratio) < 1.1


@pytest.mark.slow
def test_identified_parameters_scatter_as_told():
    """95 % intervals over experiments with new truths: sigma covers 93 to 97 %."""
    robot = arm(free=("j2.theta", "j3.d", "j3.theta", "j4.d", "j5.theta", *TOOL))
    inside, total = 0, 0
    for seed in range(size(250, 100)):
        truth = true_arm(seed=seed, names=robot.table.free, robot=robot)
        found = identify(
            robot, measured(30, seed=seed, truth=truth, sigma=1e-4), Options(hold_out=0.0, leave_one_out=False)
        )
        for p in found.parameters:
            if p.status == "identified" and p.name in robot.table:
                inside += abs(p.identified - truth.table[p.name].value) <= 1.96 * p.sigma
                total += 1
    error = np.sqrt(0.95 * 0.05 / 250)
    print(f"coverage {inside / total:.4f} of {total}, Monte Carlo error {error:.4f}")
    assert 0.93 < inside / total < 0.97
