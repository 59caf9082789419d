"""Errors of what was not fitted: folds are refits, frames met only there are profiled, and nothing leaks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from unit.arm_data import TOOL, arm, measured, true_arm
from unseen import leave_one_out

from robocal.estimate.least_squares import least_squares
from robocal.fit.misfit import errors
from robocal.fit.options import Options
from robocal.measure.base import problem, synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.prove.evidence import bootstrap_gain
from robocal.prove.folds import unseen
from robocal.prove.identify import identify
from robocal.prove.judge import drawn
from robocal.prove.split import leave_one_out_rounds, make_split

DAYS = ("monday", "tuesday", "friday")


def three_days(m=20, sigma=2e-5, seed=0, truth=None):
    """One robot, three days, the tracker elsewhere every day."""
    rng = np.random.default_rng(seed)
    data = None
    for i, day in enumerate(DAYS):
        frame = Frame(day, (1.0 + i, 2.0 - i, 0.3, 0.1, 0.2 * i, 1.0), (True,) * 6)
        q = rng.uniform(-1, 1, (m, 5))
        where = Configurations(tuple(f"{day}{j}" for j in range(m)), q, groups=(day,) * m)
        obs = Observations("position", np.arange(m), np.zeros((m, 3)), np.full((m, 3), sigma), frame)
        made = synthesise(truth or true_arm(), DataSet(where, (obs,)), rng)
        hidden = replace(made.observations[0], frame=replace(frame, value=(0.0,) * 6))
        part = DataSet(where, (hidden,))
        data = part if data is None else data + part
    return data


def test_folds_are_refits_of_reduced_data():
    robot, data = arm(free=("j2.d", "j3.d", "j3.theta")), measured(24, known=True)
    p = problem(robot, data)
    x = least_squares(p).x
    split = make_split(data, 0.0, folds=4)
    found = unseen(p, x, split, ("m",))
    assert not found.profiled.any()
    for k in range(4):
        fitted, held = split.configurations(k)
        own = least_squares(problem(robot, data.take(fitted))).x
        by_hand, at = errors(problem(robot, data.take(held)).residuals(own), "m")
        np.testing.assert_allclose(found.value["m"][held[at]], by_hand, rtol=1e-3)


def test_leave_one_out_of_pairs_does_not_see_the_other_end():
    """Rows from one pose to the next. A gross error at one row must not show in the prediction of its neighbours' rounds
    as soon as these share a place with it."""
    m = 16
    q = np.random.default_rng(1).uniform(-1, 1, (m, 5))
    where = Configurations(tuple(map(str, range(m))), q)
    first = np.arange(m - 1)
    obs = Observations("displacement", first, np.zeros((m - 1, 3)), np.full((m - 1, 3), 2e-5), second=first + 1)
    robot = arm(free=("j2.d", "j3.d", "j3.theta"))
    data = synthesise(robot, DataSet(where, (obs,)), np.random.default_rng(0))
    wrong = data.observations[0].value.copy()
    wrong[7] += 0.01
    dirty = DataSet(where, (replace(data.observations[0], value=wrong),))
    missed = []
    for some in (data, dirty):
        p = problem(robot, some)
        missed.append(unseen(p, least_squares(p).x, leave_one_out_rounds(some), ("m",)).value["m"])
    neighbours, others = [6, 8], [0, 1, 2, 3, 4, 12, 13, 14]
    np.testing.assert_allclose(missed[1][neighbours], missed[0][neighbours], rtol=0.05, atol=1e-6)
    assert (np.abs(missed[1][others] - missed[0][others]) > 1e-5).any(), "elsewhere the gross error is felt"


@pytest.mark.sampled(1)
@pytest.mark.parametrize("options", [{"folds": 3}, {"folds": 3, "reselect": True}, {}])
def test_a_new_placement_is_profiled(options):
    """The tracker of the held-out day is found from that day's rows, for both models, and the figure says so."""
    found = identify(arm(), three_days(), Options(hold_out="group", leave_one_out=False, **options))
    (stage,) = found.stages
    before, after = (stage.k_fold_before, stage.k_fold) if options else (stage.held_out_before, stage.held_out)
    assert before.profiled and after.profiled and found.verdict.status == "improved"
    assert after.n == (60 if options else 20) and after.mean < 6e-5 < 3e-4 < before.mean
    if options:
        assert [f.name for f in stage.folds] == sorted(DAYS) and all(f.profiled and f.n == 20 for f in stage.folds)
        assert np.average([f.after for f in stage.folds]) == pytest.approx(after.mean)
        assert found.held_out_ids == () and len(found.fit_ids) == 60 and found.how == "3 folds of groups"
    np.testing.assert_allclose(np.nanmean(found.rows.unseen), after.mean)
    plain = identify(arm(), three_days(), Options(leave_one_out=False, folds=4)).stages[0].k_fold
    assert not plain.profiled and after.mean < 1.6 * plain.mean


def test_degrees_of_freedom_of_the_profile_are_put_back():
    """The true robot, its frame fitted to n held-out rows: without the factor rms would fall short by (1 - 6 / 3 n)."""
    ratio, raw = [], []
    robot = arm(free=())
    for seed in range(60):
        data = three_days(m=6, seed=seed, truth=robot)
        p = problem(robot, data)
        known = problem(robot, three_days(m=6, seed=seed, truth=robot))
        start = _where_they_stand(known)
        x = least_squares(p, start).x
        found = unseen(p, x, make_split(data, "group", folds=3), ("m",), p.free)
        assert found.profiled.all()
        ratio.append(np.mean(found.value["m"] ** 2))
        raw.append(np.mean(errors(p.residuals(x), "m")[0] ** 2))
    assert np.mean(ratio) == pytest.approx(3 * 2e-5**2, rel=0.06)
    assert np.mean(raw) == pytest.approx(3 * 2e-5**2 * (1 - 6 / 18), rel=0.06)


def _where_they_stand(p):
    x = p.start.copy()
    for i, day in enumerate(DAYS):
        for s, v in zip(("x", "y", "z", "rx", "ry", "rz"), (1.0 + i, 2.0 - i, 0.3, 0.1, 0.2 * i, 1.0), strict=True):
            x[0, p.table.index[f"{day}.{s}"]] = v
    return x


def test_as_many_numbers_as_unknowns_prove_nothing():
    """A marker seen once is met exactly by its own place: no error of zero is reported."""
    marker = Frame("once", (0.0,) * 6, (True,) * 3 + (False,) * 3, "tool")
    usual = Frame("usual", (0.0,) * 6, (False,) * 6, "tool")
    target = np.zeros(30, dtype=int)
    target[7] = 1
    data = measured(30, targets=(usual, marker), target=target)
    found = identify(arm(free=tuple(n for n in arm().table.free if n not in TOOL)), data, Options(hold_out=0.0))
    once = np.array(found.rows.target) == "once"
    assert once.sum() == 1 and np.isnan(found.rows.unseen[once]).all() and np.isfinite(found.rows.unseen[~once]).all()
    assert found.stages[0].leave_one_out.n == 29 and found.verdict.status == "improved"


def test_reselecting_is_what_an_identification_of_the_others_finds():
    data = measured(40)
    split = make_split(data, 0.0, folds=2, seed=0)
    found = identify(arm(), data, Options(folds=2, reselect=True))
    by_hand = np.full(40, np.nan)
    for k in range(2):
        fitted, held = split.configurations(k)
        part = identify(arm(), data.take(fitted), Options(hold_out=0.0, leave_one_out=False))
        made = problem(part.corrected, data, values=dict(zip(part.table.names, part.table.values, strict=True)))
        by_hand[held] = errors(made.residuals(made.start), "m")[0][held]
    np.testing.assert_allclose(found.rows.unseen, by_hand, rtol=1e-3, atol=1e-9)


def test_folds_of_nothing_new_prove_no_gain():
    """The true robot: whatever is fitted, folds do not get better."""
    found = identify(arm(), measured(40, truth=arm()), Options(folds=5))
    assert found.verdict.status == "not_improved" and "5 folds" in " ".join(map(str, found.verdict.reasons))


def test_leave_one_out_of_a_chunk_boundary(monkeypatch):
    data = measured(20, known=True)
    p = problem(arm(free=("j2.d", "j3.d")), data)
    x = least_squares(p).x
    whole = leave_one_out(p, x, np.arange(20))
    monkeypatch.setattr("robocal.prove.folds.CHUNK", 7)
    np.testing.assert_allclose(leave_one_out(p, x, np.arange(20)), whole, rtol=1e-9)


def test_whole_blocks_are_drawn():
    """Errors that hang together within a block: six blocks are six pieces of evidence, and the interval is as wide."""
    data = measured(60)
    split = make_split(data, "blocks", folds=6)
    label, at = np.arange(60), np.arange(60)
    np.testing.assert_array_equal(drawn(split, label, at), np.repeat(np.arange(6), 10))
    np.testing.assert_array_equal(drawn(split, label, at[:40]), label[:40])  # four blocks are too few to draw from
    np.testing.assert_array_equal(drawn(make_split(data, 0.0, folds=6), label, at), label)
    drift = np.repeat(np.random.default_rng(0).normal(1, 2, 6), 10) + 1e-3 * np.random.default_rng(1).normal(size=60)
    wide = bootstrap_gain(drift, np.zeros(60), drawn(split, label, at), 0)
    narrow = bootstrap_gain(drift, np.zeros(60), label, 0)
    assert wide[2] - wide[1] > 2 * (narrow[2] - narrow[1])


def one_joint_at_a_time(m=12):
    """Five groups; in each, one joint moves and the others stand still."""
    q = np.tile([0.2, -0.3, 0.4, 0.1, 0.2], (5 * m, 1))
    for k in range(5):
        q[k * m : (k + 1) * m, k] = np.linspace(-1, 1, m)
    data = measured(q=q, m=5 * m)
    groups = tuple(f"joint {k + 1}" for k in np.repeat(range(5), m))
    return replace(data, configurations=replace(data.configurations, groups=groups))


def test_what_a_round_cannot_see_is_not_known_from_the_rows_that_it_holds_out():
    """A joint that moves in the held-out group alone: its zero is that of the round's own baseline, not of the fit to
    everything, or held-out rows would be met by what they said themselves."""
    robot, data = arm(), one_joint_at_a_time()
    found = identify(robot, data, Options(hold_out="group", folds=5))
    fitted, held = make_split(data, "group", folds=5).configurations(0)
    made, names = problem(robot, data.take(fitted)), found.correlation_names
    near = least_squares(made.with_free([n for n in names if n.startswith(("tracker", "tool"))]), _tracker(made)).x
    x = least_squares(made.with_free(names), near).x
    by_hand = errors(problem(robot, data.take(held)).residuals(x), "m")[0]
    assert by_hand.mean() > 2e-4, "0.02 mm would be the noise"
    np.testing.assert_allclose(found.rows.unseen[held], by_hand, rtol=0.02)


def _tracker(p):
    x = p.start.copy()
    x[0, [p.table.index[f"tracker.{s}"] for s in ("x", "y", "z", "rx", "ry", "rz")]] = (1.0, 2.0, 0.3, 0.1, 0.2, 1.0)
    return x


@pytest.mark.parametrize("options", [{"hold_out": 0.0}, {"hold_out": 0.2, "leave_one_out": False, "seed": 2}])
@pytest.mark.parametrize("contacts", [3, 12])
def test_a_plane_that_is_left_with_two_points_proves_nothing(contacts, options):
    """Two points do not tell how a plane is tilted: the third would be met by the plane that it has tilted itself, or
    missed by centimetres by any other."""
    rng = np.random.default_rng(5)
    where = Configurations(tuple(f"c{i}" for i in range(contacts)), rng.uniform(-1, 1, (contacts, 5)))
    plate = Frame("plate", (0.2, 0.1, 0.0, 0.05, -0.1, 0.0), (False, False, True, True, True, False))
    touches = Observations(
        "plane", np.arange(contacts), np.zeros((contacts, 1)), np.full((contacts, 1), 2e-5), options={"place": plate}
    )
    made = synthesise(true_arm(), DataSet(where, (touches,)), rng)
    blank = replace(plate, value=(0.2, 0.1, 0.0, 0.0, 0.0, 0.0))
    data = measured(30) + DataSet(where, (replace(made.observations[0], options={"place": blank}),))
    found = identify(arm(), data, Options(**options))
    seen, plane = found.rows, np.array(found.rows.kind) == "plane"
    judged = seen.held_out if options["hold_out"] else np.ones(len(plane), dtype=bool)
    assert plane.sum() == contacts and (judged & plane).any() and found.verdict.status == "improved"
    assert np.isfinite(seen.unseen[judged & ~plane]).all()
    assert (np.isnan(seen.unseen[judged & plane]) if contacts == 3 else seen.unseen[judged & plane] < 4e-4).all()
