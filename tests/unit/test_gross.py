"""Gross rows are set aside by one rule for both models, told by name, and counted in no mean that decides."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from unit.arm_data import arm, measured
from unit.test_outliers import FAST, spoiled

from robocal.diagnose.gross import _fit_within_noise, set_aside, share, sift
from robocal.estimate.solution import Reason
from robocal.fit.baseline import baseline
from robocal.fit.fit import fit
from robocal.fit.options import Options
from robocal.measure.base import problem
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.prove.claims import fits_without_convergence
from robocal.prove.identify import identify
from robocal.remarks.code import Code

FAR = {3: [0.2, 0, 0], 11: [0, 0.05, 0], 40: [0, 0, 0.5]}


def zeroed(data, rows):
    obs = data.observations[0]
    value = np.array(obs.value)
    value[rows] = 0.0
    return replace(data, observations=(replace(obs, value=value),))


@pytest.mark.parametrize("loss", ["none", "huber", "cauchy", "tukey"])
def test_what_is_set_aside_moves_neither_model_nor_mean(loss):
    clean = identify(arm(), measured(60), Options(loss=loss, leave_one_out=False))
    found = identify(arm(), spoiled(measured(60), FAR), Options(loss=loss, leave_one_out=False))
    assert found.verdict.status == clean.verdict.status == "improved"
    stage, every, whole = found.stages[0], found.stages[0].all_rows, clean.stages[0]
    assert clean.stages[0].all_rows is None
    assert stage.held_out.mean == pytest.approx(whole.held_out.mean, rel=0.15)
    assert stage.held_out_before.mean == pytest.approx(whole.held_out_before.mean, rel=0.15)
    counts = [s.after.n + s.held_out.n for s in (stage, every, whole)]
    assert counts[0] == 57 and counts[1] == counts[2] == 60 and every.after.max > 0.04
    assert {o.configuration for o in found.outliers if o.set_aside and not o.counted} == {"p3", "p11", "p40"}
    assert {c for c, a in zip(found.rows.configuration, found.rows.aside, strict=True) if a} == {"p3", "p11", "p40"}


def test_a_dropped_beam_is_named():
    found = identify(arm(), zeroed(measured(60), [5, 17]), FAST)
    assert [o.cause.code for o in found.outliers] == [Code.CAUSE_ZEROS] * 2
    assert all(o.value == (0.0, 0.0, 0.0) for o in found.outliers)
    slipped, one = (
        identify(arm(), spoiled(measured(60), {7: off}), FAST).outliers[0].cause
        for off in ([3e-3, -2e-3, 4e-3], [3e-3, 0, 0])
    )
    assert slipped.code == Code.CAUSE_ALONE
    assert one.code == Code.ROW_COLUMN and one.numbers["column"] == 1


def test_too_many_gross_rows_are_no_outliers():
    rng = np.random.default_rng(1)
    bad = {int(i): rng.normal(0, 0.3, 3) for i in rng.choice(60, 15, replace=False)}
    found = identify(arm(), spoiled(measured(60), bad), Options(leave_one_out=False))
    assert found.verdict.status == "refused"
    assert found.verdict.reasons[0].code == Code.TOO_MANY_ASIDE


def test_rows_that_are_not_fitted_are_not_judged():
    data = spoiled(measured(60), FAR)
    clean = set_aside(arm(), data, np.setdiff1d(np.arange(60), [3, 40]))
    assert np.flatnonzero(~clean.observations[0].used).tolist() == [11]
    assert share(clean) == pytest.approx(1 / 60)


@pytest.mark.parametrize("size", [0.0, 3.0, 5.0, 6.0, 7.0, 9.0, 30.0])
def test_a_plain_fit_within_the_noise_finds_no_other_rows_gross(size):
    """Where a plain fit leaves the stated noise and every row is near, no robust fit is asked: it would set nothing aside either."""
    data = measured(60)
    off = size * float(data.observations[0].sigma[0, 0]) / np.sqrt(3)
    data = spoiled(data, {7: off, 22: -off, 41: off})
    clean, known = set_aside(arm(), data, np.arange(60)), sift(arm(), data, np.arange(60)).data
    assert share(clean) == share(known)
    for a, b in zip(clean.observations, known.observations, strict=True):
        assert a.used is None if b.used is None else np.array_equal(a.used, b.used)
    assert (_fit_within_noise(arm(), data, np.arange(60)) is None) == (size > 5.0)
    unstated = replace(data, observations=(replace(data.observations[0], sigma=None),))
    assert _fit_within_noise(arm(), unstated, np.arange(60)) is None


@pytest.mark.parametrize("size", [0.0, 7.0, 300.0])
@pytest.mark.parametrize("loss", ["none", "tukey"])
def test_what_the_search_knows_of_the_noise_changes_no_fit(loss, size):
    """The fit takes the rounds of the noise over where it asks the same of the same rows, and of no others."""
    data, model, everyone = measured(60), arm(), np.arange(60)
    off = size * float(data.observations[0].sigma[0, 0])
    data = spoiled(data, {7: off, 22: -off})
    clean, start = set_aside(model, data, everyone), baseline(model, data, everyone)[1]
    alone = replace(clean, configurations=replace(clean.configurations, columns=dict(clean.configurations.columns)))
    assert clean.configurations.memo and not alone.configurations.memo
    one, other = (fit(model, d, everyone, Options(loss=loss), start) for d in (clean, alone))
    assert np.array_equal(one.solution.x, other.solution.x)
    assert one.groups == other.groups
    assert np.array_equal(one.identifiability.fitted.x, other.identifiability.fitted.x)


@pytest.mark.parametrize("loss", ["none", "huber", "cauchy", "tukey"])
def test_no_loss_weighs_down_a_constraint(loss):
    """A known distance between two sockets reads nothing of the robot: it costs its square, however far it is off."""
    ends = Frame("a", (0.5, 0, 0.1, 0, 0, 0)), Frame("b", (0.6, 0, 0.1, 0, 0, 0))
    one = np.zeros(1, dtype=np.int64)
    bar = Observations("distance", one, np.array([[0.05]]), np.array([[1e-4]]), options={"ends": ends})
    made = problem(arm(), DataSet(Configurations(("bar",), np.full((1, 5), np.nan)), (bar,))).with_loss(loss)
    assert not made.terms[0].reading
    assert made.normal(made.start).cost[0] == pytest.approx(0.5 * 500**2)
    assert problem(arm(), measured(5)).terms[0].reading


def test_no_fit_that_did_not_converge_is_improved():
    class Ended:
        def __init__(self, reason=Reason.COST, converged=True):
            self.reasons, self.converged = (reason,), converged
            self.solution = self.before = self.after = self

    def what(whole, proof, started=True):
        known = {"need_baseline": Ended(converged=started), "need_fit": whole, "proof": proof, "chosen": Options()}
        known["model"] = SimpleNamespace(parts={}, table={})
        return [f.numbers["what"] for f in fits_without_convergence.run(SimpleNamespace(**known))]

    good, bad = Ended(), Ended()
    assert what(good, good) == []
    assert what(good, good, started=False) == ["the baseline"]
    assert what(Ended(Reason.ITERATIONS), good) == ["the fit to everything"]
    bad.after = Ended(converged=False)
    assert what(good, bad) == ["a round"]
