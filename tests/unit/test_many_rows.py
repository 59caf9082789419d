"""Many rows begin on a part of them: what is told of them is what all of them say, and held-out rows have no say in it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from unit.arm_data import TRACKER, arm, measured
from unit.test_outliers import spoiled

from robocal.diagnose import rounding
from robocal.diagnose.gross import sift
from robocal.estimate import uncertainty as bars
from robocal.estimate.least_squares import least_squares
from robocal.estimate.uncertainty import effective_columns, uncertainty
from robocal.fit import baseline as baselines
from robocal.fit import subsample
from robocal.fit.baseline import fit_baseline, renew_baseline
from robocal.fit.noise import apply_noise
from robocal.fit.soft_fit import soften
from robocal.fit.subsample import ENOUGH, MANY
from robocal.fit.subsample import subsample as thinned
from robocal.measure.base import problem
from robocal.measure.data import DataSet, Frame
from robocal.prove.evidence import _cornish_fisher, _drawn

M = 3000


@pytest.fixture(scope="module")
def many():
    return measured(M)


def gross(data, share, seed=5, size=0.01):
    rng = np.random.default_rng(seed)
    rows = rng.choice(M, round(share * M), replace=False)
    return spoiled(data, {int(i): rng.normal(0, size, 3) for i in rows})


def used(found):
    o = found.data.observations[0]
    return np.ones(len(o), bool) if o.used is None else o.used


def test_a_part_is_spread_over_all_rows_and_over_every_target(many):
    everyone = np.arange(M)
    few = measured(MANY)
    assert thinned(arm(), few, np.arange(MANY))[0] is few
    made, units = thinned(arm(), many, everyone)
    assert len(made.observations[0]) == len(made.configurations) == len(units) == ENOUGH
    row = np.array([int(name[1:]) for name in made.configurations.ids])
    np.testing.assert_array_equal(made.observations[0].value, many.observations[0].value[row])
    assert np.diff(row).max() < 3 * M / ENOUGH
    # No period of a grid is fallen in with: of every so many rows, each phase has its share.
    for period in range(2, 31):
        count = np.bincount(row % period, minlength=period)
        assert count.min() > 0.5 * ENOUGH / period, period
    target = (np.arange(M) % 50 == 0).astype(np.int64)
    two = measured(M, targets=(Frame("a", mount="tool"), Frame("b", (0, 0, 0.1, 0, 0, 0), mount="tool")), target=target)
    kept = thinned(arm(), two, everyone)[0].observations[0]
    assert np.bincount(kept.target).tolist() == [ENOUGH, M // 50]
    half = np.arange(0, M, 2)
    assert thinned(arm(), many, half)[0] is many
    # Who has no row among the units would be without any.
    other = replace(many.observations[0], frame=Frame("other"), group="other").take(np.arange(2500, M))
    both = DataSet(many.configurations, (*many.observations, other))
    assert thinned(arm(), both, np.arange(2500))[0] is both


def test_a_part_keeps_both_ends_of_its_rows(many):
    """A row that compares two configurations keeps the other one, whether that is fitted or not."""
    obs = replace(many.observations[0], kind="displacement", second=np.roll(np.arange(M), 1))
    made, units = thinned(arm(), DataSet(many.configurations, (obs,)), np.arange(2500))
    name = np.array([int(n[1:]) for n in made.configurations.ids])
    first, second = name[made.observations[0].configuration], name[made.observations[0].second]
    assert (second == (first - 1) % M).all() and first.max() < 2500 and len(first) == ENOUGH
    assert set(name[units]) == {n for n in name if n < 2500}


@pytest.mark.parametrize("share", [0.0, 0.002, 0.15])
def test_gross_rows_of_many_are_those_without_thinning(many, share, monkeypatch):
    """Down to rows that are hardly gross at all; and how far each row is, is told of the fit to all rows."""
    data = gross(gross(many, share), share, seed=6, size=3e-4)
    found = sift(arm(), data, np.arange(M))
    monkeypatch.setattr(subsample, "MANY", 10 * M)
    whole = sift(arm(), data, np.arange(M))
    assert (used(found) == used(whole)).all() and (~used(whole)).sum() >= share * M
    np.testing.assert_allclose(found.away.distance[0], whole.away.distance[0], atol=0.03, rtol=0.01)


def test_rows_that_are_held_out_have_no_say(many):
    fitted, held = np.arange(M) % 5 > 0, np.arange(M) % 5 == 0
    data = gross(many, 0.01)
    obs = data.observations[0]
    moved = DataSet(data.configurations, (replace(obs, value=np.where(held[:, None], 7.0 - obs.value, obs.value)),))
    a, b = (sift(arm(), d, np.flatnonzero(fitted)) for d in (data, moved))
    assert (used(a) == used(b)).all() and used(a)[held].all()
    np.testing.assert_array_equal(a.x, b.x)
    x, y = (fit_baseline(arm(), d, np.flatnonzero(fitted)).x for d in (data, moved))
    np.testing.assert_array_equal(x, y)


def test_the_baseline_of_many_rows_is_that_of_all_of_them(many, monkeypatch):
    everyone = np.arange(M)
    found = fit_baseline(arm(), many, everyone)
    noisy = apply_noise(many, {("tracker", "m"): 1e-3})
    assert renew_baseline(arm(), (many, found), apply_noise(many, {}), everyone) is found
    again = renew_baseline(arm(), (many, found), noisy, everyone)
    monkeypatch.setattr(subsample, "MANY", 10 * M)
    for data, mine in ((many, found), (noisy, again)):
        whole = fit_baseline(arm(), data, everyone)
        assert mine.converged and whole.converged
        free = whole.problem.with_free([f"{TRACKER.name}.{s}" for s in ("x", "y", "z", "rx", "ry", "rz")])
        # A fit ends where the next step promises 1e-10 of the cost: 1e-5 sqrt(N) of its standard deviations.
        sigma = uncertainty(free, whole.x).sigma
        assert np.abs((mine.x - whole.x)[0, free.index] / sigma).max() < 1e-5 * np.sqrt(3 * M)


def test_frames_of_many_rows_are_looked_for_once(many, monkeypatch):
    """A part of many begins where all of them place the frames, and ends where its own search ends; a part of few, or of other values
    at the same configurations, looks for itself."""
    searches = []

    def counted(*args):
        searches.append(len(args[1].configurations))
        return search(*args)

    search = baselines._fit_frames
    monkeypatch.setattr(baselines, "_fit_frames", counted)
    model, part = arm(), np.arange(0, M, 2)
    alone = fit_baseline(model, measured(M), part)
    assert searches == [M]
    fit_baseline(model, many, np.arange(M))
    found = fit_baseline(model, many, part)
    assert searches == [M, M]
    np.testing.assert_allclose(found.x, alone.x, atol=1e-7)
    moved = replace(many.observations[0], value=many.observations[0].value + 0.1)
    fit_baseline(model, DataSet(many.configurations, (moved,)), part)
    assert searches == [M] * 3
    few = measured(60)
    fit_baseline(model, few, np.arange(60))
    fit_baseline(model, few, np.arange(40))
    assert searches == [M] * 3 + [60, 60]


def test_rounding_that_cannot_be_seen_is_not_worked_out(many, monkeypatch):
    """And where it can, it is: by the same rows as without thinning."""
    for last in (1e-9, 1e-4):
        where = replace(many.configurations, digits=np.full((M, 5), last))
        obs = replace(many.observations[0], digits=np.full((M, 3), last))
        data = replace(gross(DataSet(where, (obs,)), 0.002), configurations=where)
        found = sift(arm(), data, np.arange(M))
        assert (found.data.observations[0].rounding is None) == (last == 1e-9)
        with monkeypatch.context() as patch:
            patch.setattr(rounding, "_nothing", lambda *_: False)
            whole = sift(arm(), data, np.arange(M))
        assert whole.data.observations[0].rounding is not None
        for a, b in zip(found.away.distance, whole.away.distance, strict=True):
            np.testing.assert_array_equal(a, b)
        assert (used(found) == used(whole)).all()


@pytest.mark.parametrize("law", ["normal", "exponential", "lognormal", "steps"])
def test_the_ends_of_a_mean_of_many_are_where_draws_tend(law, rng):
    n = 1000
    gain = {
        "normal": rng.normal(0.1, 1, n),
        "exponential": rng.exponential(1, n),
        "lognormal": rng.lognormal(0, 0.6, n),
        "steps": (rng.uniform(size=n) < 0.1).astype(float),
    }[law]
    ends, drawn = _cornish_fisher(gain), _drawn(gain, np.ones(n), 0, 40_000)
    # A percentile of so many draws scatters by 0.013 standard deviations of the mean.
    assert np.abs(np.subtract(ends, drawn)).max() < 0.04 * gain.std() / np.sqrt(n)


def test_a_mean_that_few_rule_is_drawn():
    assert _cornish_fisher(np.append(np.zeros(1999), 1.0)) is None
    assert _cornish_fisher(np.ones(2000)) is None


@pytest.mark.parametrize("sigma", [1e-3, 2e-5, 1e-12])
def test_columns_are_counted_alike_by_cholesky_and_by_rotations(sigma, monkeypatch):
    data = measured(60, sigma=sigma)
    made = problem(arm(), data)
    x = least_squares(soften(made, made.start), made.start).x
    soft = soften(made, x)
    fast = effective_columns(soft, x)
    monkeypatch.setattr(bars, "_prior_trace", lambda *_: None)
    assert fast == pytest.approx(effective_columns(soft, x), abs=1e-6)
    assert 0 < fast <= made.n
