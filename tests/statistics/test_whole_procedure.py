"""Intervals of `identify` as a whole: a new robot in every trial, off by what one expects, instrument somewhere, columns
selected from the data; and gross outliers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sizes import size
from trials import TRACKER, joints, observations, perturbed

from robocal.files.robot import open_robot
from robocal.fit.options import Options
from robocal.geometry import fits
from robocal.measure.base import synthesise
from robocal.measure.data import DataSet
from robocal.prove.identify import identify

pytestmark = pytest.mark.slow
TRIALS = size(200, 60)


def measured(robot, rng, kind, m):
    """A true robot, and what an instrument somewhere says of it."""
    truth = perturbed(robot, rng)
    place = replace(TRACKER, value=(*rng.uniform(-1.5, 1.5, 3), *rng.uniform(-1, 1, 3)))
    obs = replace(observations(kind, m), frame=place)
    data = synthesise(truth, DataSet(joints(robot, rng, m), (obs,)), rng)
    forgotten = replace(data.observations[0], frame=replace(place, value=(0.0,) * 6))
    return truth, place, replace(data, observations=(forgotten,))


@pytest.mark.parametrize("stated", [True, False], ids=["sigma stated", "sigma estimated"])
@pytest.mark.parametrize(("robot", "kind"), [("rv-2aj", "position"), ("ur10", "pose"), ("panda", "position")])
def test_intervals_cover_after_selection(robot, kind, stated):
    model, rng = open_robot(robot).chain, np.random.default_rng(77 + stated)
    inside, names = [], []
    for _ in range(TRIALS):
        truth, place, data = measured(model, rng, kind, 50)
        if not stated:
            data = replace(data, observations=(replace(data.observations[0], sigma=None),))
        found = identify(model, data, Options(hold_out=0.0, leave_one_out=False))
        real = {p.name: p.value for p in (*truth.table.rows, *place.parameters)}
        for p in found.parameters:
            if p.interval is not None:
                inside.append(p.interval[0] <= real[p.name] <= p.interval[1])
                names.append(p.name)
    inside, names = np.array(inside), np.array(names)
    each = {n: inside[names == n].mean() for n in sorted(set(names)) if (names == n).sum() >= TRIALS / 2}
    worst, best = min(each, key=each.get), max(each, key=each.get)
    # Errors of one trial hang together: the trial, not the interval, is the unit of chance.
    chance = np.sqrt(0.95 * 0.05 / TRIALS)
    print(
        f"\n{robot} {kind}, {'stated' if stated else 'estimated'} sigma, {TRIALS} robots, {len(each)} parameters: intervals of the whole procedure "
        f"cover {inside.mean():.2%}; least {worst} {each[worst]:.1%}, most {best} {each[best]:.1%}, each +- {chance:.1%}"
    )
    assert 0.93 < inside.mean() < 0.97
    assert each[worst] > 0.95 - 4.5 * chance


@pytest.mark.parametrize(("robot", "kind"), [("rv-2aj", "position"), ("ur10", "position"), ("panda", "pose")])
def test_five_percent_gross_outliers(robot, kind):
    """Whatever the loss, the fit stays within 20 % of the error without outliers: they are set aside."""
    model, rng, m = open_robot(robot).chain, np.random.default_rng(5), 100
    q = joints(model, np.random.default_rng(6), 300).joints
    errors = []
    for _ in range(size(20, 8)):
        truth, _, data = measured(model, rng, kind, m)
        obs = data.observations[0]
        value = np.array(obs.value)
        value[rng.choice(m, m // 20, replace=False), :3] += rng.normal(size=(m // 20, 3)) * rng.uniform(
            2e-3, 2e-2, (m // 20, 1)
        )
        bad = replace(data, observations=(replace(obs, value=value),))
        row = []
        for some, loss in ((data, "none"), (bad, "none"), (bad, "huber"), (bad, "cauchy"), (bad, "tukey")):
            found = identify(model, some, Options(hold_out=0.0, leave_one_out=False, loss=loss))
            row.append(error(found.corrected, truth, q))
        errors.append(row)
    errors = np.array(errors)
    clean, plain, huber, cauchy, tukey = errors.mean(axis=0)
    chance = (errors / clean).std(axis=0, ddof=1) / np.sqrt(len(errors))
    print(
        f"\n{robot} {kind}, 5 % outliers of 2 to 20 mm, {len(errors)} robots: error {clean * 1e3:.4f} mm without outliers; times that: plain "
        f"{plain / clean:.2f}, huber {huber / clean:.3f} +- {chance[2]:.3f}, cauchy {cauchy / clean:.3f} +- {chance[3]:.3f}, tukey {tukey / clean:.3f} +- {chance[4]:.3f}"
    )
    assert max(plain, huber, cauchy, tukey) <= 1.2 * clean


def error(model, truth, q):
    """Mean error of the tool's place over the workspace, base aligned: the instrument's frame is free."""
    a, b = model.pose(q)[:, :3, 3], truth.pose(q)[:, :3, 3]
    t = fits.rigid(a, b)
    return float(np.linalg.norm(a @ t[:3, :3].T + t[:3, 3] - b, axis=1).mean())
