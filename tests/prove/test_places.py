"""Places that are visited again count once: a place has a diameter and stands apart from others, and rows of a path are no places.

What a model or an instrument leaves at a place is the same at every visit: var(mean of m visits) = tau^2 + sigma^2 / m.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from prove.machines import cables
from scipy.stats import binom, norm
from sizes import size
from unit.arm_data import arm, measured, true_arm

from robocal.diagnose.limits import PLACE_DIAMETER, PLACE_GAP
from robocal.fit import fit as fits
from robocal.fit.options import Options
from robocal.fit.place_noise import visit_again, weigh_visits
from robocal.fit.repeats import NEAR, joined, places
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet
from robocal.prove.identify import identify
from robocal.prove.split import default_hold_out, make_split
from robocal.remarks.code import Code

DEG = np.pi / 180


def where(q, start=None):
    return Configurations(tuple(map(str, range(len(q if start is None else start)))), q, start=start)


def visits(rng, count, times, jitter, joints=5, reach=1.2):
    """Joint values of some places, each visited so many times; one after the other, with which place each is."""
    q = np.repeat(rng.uniform(-reach, reach, (count, joints)), times, axis=0)
    return q + jitter * rng.normal(size=q.shape), np.repeat(np.arange(count), times)


def recorded(rng, count, times, jitter=0.1 * DEG, *, wrong=0.0, tau=4e-4, sigma=3e-5, stated=False):
    """What a tracker says of an arm that is `wrong` (m, rad), off by tau at every place, by sigma at every visit."""
    robot = arm()
    truth = robot.with_values({n: robot.table[n].value + wrong * rng.normal() for n in robot.table.free if n[0] == "j"})
    q, place = visits(rng, count, times, jitter)
    data = measured(len(q), q=q, truth=truth, sigma=sigma, seed=int(rng.integers(1 << 30)), stated=stated)
    obs = data.observations[0]
    value = obs.value + tau * rng.normal(size=(count, 3))[place]
    return robot, replace(data, observations=(replace(obs, value=value),)), place


@pytest.mark.parametrize("joints", [3, 6])
@pytest.mark.parametrize("jitter", [0.01, 0.1, 0.5])
def test_visits_are_one_place_however_closely_they_come_back(jitter, joints):
    rng = np.random.default_rng(joints)
    q, place = visits(rng, 18, 4, jitter * DEG, joints)
    assert len(np.unique(joined(where(q), NEAR))) > 30
    np.testing.assert_array_equal(places(where(q)), place)
    mixed = rng.permutation(72)
    _, again = np.unique(places(where(q[mixed])), return_inverse=True)
    assert all(len(set(again[place[mixed] == p])) == 1 for p in range(18)) and len(set(again)) == 18
    start = np.concatenate([q, np.zeros((72, 6 - joints))], axis=1)
    np.testing.assert_array_equal(places(where(None, start)), place)


def test_a_place_has_a_diameter_and_a_path_has_no_places():
    rng = np.random.default_rng(0)
    turn = np.linspace(0, 2 * np.pi, 700)[:, None]
    path = np.sin(turn * [1.0, 1.3, 0.7, 2.1, 1.7] + np.arange(5))
    for q in (
        path,
        path + 1e-4 * rng.normal(size=path.shape),
        path[::7],
        np.cumsum(0.01 * rng.normal(size=(600, 5)), 0),
    ):
        assert len(np.unique(places(where(q)))) > 0.99 * len(q)
    s = np.linspace(0, 1, 40)[:, None]
    via = rng.uniform(-1.2, 1.2, (15, 5))
    stops = np.concatenate([a + (b - a) * s**2 * (3 - 2 * s) for a, b in pairwise(via)])
    np.testing.assert_array_equal(places(where(stops)), joined(where(stops), NEAR))
    # A list whose poses stand closer than a place is wide, but not apart: a grid, and a dense cloud.
    grid = np.stack(np.meshgrid(*[np.arange(6) * PLACE_DIAMETER / 2] * 3), -1).reshape(-1, 3)
    cloud = rng.uniform(-1.2, 1.2, (300, 3))
    for q in (grid, cloud):
        np.testing.assert_array_equal(places(where(q)), np.arange(len(q)))


def test_a_few_poses_that_stand_close_are_no_habit():
    rng = np.random.default_rng(1)
    q = rng.uniform(-1.2, 1.2, (40, 5))
    q[30:36] = q[:6] + 0.2 * DEG * rng.normal(size=(6, 5))
    np.testing.assert_array_equal(places(where(q)), np.arange(40))
    q[20:40] = q[:20] + 0.2 * DEG * rng.normal(size=(20, 5))
    np.testing.assert_array_equal(places(where(q)), np.tile(np.arange(20), 2))


def test_two_places_are_not_joined_where_they_are_less_apart_than_visits_scatter():
    close, far = (
        np.repeat([[0.0, 0], [gap, 0]], 8, axis=0) for gap in (PLACE_DIAMETER, PLACE_DIAMETER * PLACE_GAP * 1.3)
    )
    jitter = 0.3 * PLACE_DIAMETER * np.random.default_rng(2).uniform(-1, 1, (16, 2))
    assert len(np.unique(places(where(close + jitter)))) == 16
    assert len(np.unique(places(where(far + jitter)))) == 2


@pytest.mark.parametrize(("count", "times", "jitter"), [(28, 3, 0.1), (18, 4, 0.02), (40, 3, 0.5)])
def test_a_perfect_arm_is_not_improved_by_an_instrument_that_errs_by_place(count, times, jitter):
    for seed in range(size(20, 2)):
        robot, data, _ = recorded(np.random.default_rng(seed), count, times, jitter * DEG, stated=seed % 2 == 0)
        for draw in range(2):
            assert identify(robot, data, Options(seed=draw)).verdict.status != "improved", seed
        label, split = places(data.configurations), make_split(data, 0.2, seed=seed)
        assert not set(label[split.held_out[0]]) & set(label[split.fit[0]])


@pytest.mark.parametrize("times", [1, 3])
def test_an_arm_that_errs_is_improved_as_ever(times):
    for seed in range(size(20, 3)):
        robot, data, _ = recorded(np.random.default_rng(seed), 40, times, 0.05 * DEG, wrong=2e-3, tau=1e-4)
        assert identify(robot, data, Options(seed=seed)).verdict.status == "improved"


def test_many_visits_of_few_places_prove_nothing():
    for count, times in ((5, 30), (4, 12)):
        robot, data, _ = recorded(np.random.default_rng(count), count, times, 0.01 * DEG, wrong=3e-3, tau=0.0)
        found = identify(robot, data)
        assert found.verdict.status == "not_improved"
        assert Code.FEW_PLACES in {r.code for r in found.verdict.reasons}


def test_stated_groups_are_what_is_held_out():
    rng = np.random.default_rng(3)
    _, data, place = recorded(rng, 30, 3)
    names = tuple(f"g{p // 2}" for p in place)
    grouped = DataSet(replace(data.configurations, groups=names), data.observations)
    assert default_hold_out(data, None) == (0.2, None) and default_hold_out(data, 4) == (0.0, 4)
    assert default_hold_out(grouped, None) == ("group", 5) and default_hold_out(grouped, 3) == ("group", 3)
    many = DataSet(replace(data.configurations, groups=tuple(f"g{p}" for p in place)), data.observations)
    assert default_hold_out(many, None) == ("group", None)
    found = identify(arm(), grouped)
    assert found.options.hold_out == "group" and found.options.folds == 5
    split = make_split(grouped, "group", folds=5)
    for held, fit in zip(split.held_out, split.fit, strict=True):
        assert not set(np.array(names)[held]) & set(np.array(names)[fit])


def test_the_weight_of_a_visit_is_what_it_adds():
    """tau and sigma known: w = (sigma^2 + tau^2) / (sigma^2 + m tau^2), and one where nothing repeats but noise."""
    from robocal.measure.base import problem

    rng, (tau, sigma) = np.random.default_rng(4), (3e-4, 2e-4)
    for off, times in ((tau, 3), (tau, 12), (0.0, 12)):
        robot, data, _ = recorded(rng, 150, times, tau=off, sigma=sigma, stated=True)
        made = problem(robot, data)
        x = fits.least_squares(made).x
        weight = weigh_visits(data, made, x, np.arange(150 * times), made.n)
        expected = (sigma**2 + off**2) / (sigma**2 + times * off**2)
        assert visit_again(data, np.arange(len(weight))) and weight == pytest.approx(
            expected, rel=0.2 if off else 1e-12
        )
    once = recorded(rng, 60, 1)[1]
    assert not visit_again(once, np.arange(60))


def test_visits_without_an_error_of_their_place_are_independent():
    """20 places, 50 visits, tau = 0: sigma within a tenth of that of as many independent rows."""
    ratio = []
    for seed in range(size(10, 3)):
        robot, data, _ = recorded(np.random.default_rng(seed), 20, 50, tau=0.0, sigma=2e-4, wrong=1e-3)
        mine = identify(robot, data, Options(hold_out=0.0, leave_one_out=False))
        scale = [p.sigma / p.sigma_conditional for p in mine.parameters if p.status == "identified"]
        ratio.append(float(np.median(scale)))
    assert 0.95 < np.median(ratio) < 1.1


@pytest.mark.slow
@pytest.mark.parametrize(("tau", "sigma", "times"), [(1e-4, 2e-5, 3), (1e-4, 1e-4, 8), (0.0, 1e-4, 8)])
def test_intervals_hold_the_truth_whatever_repeats(tau, sigma, times):
    inside = total = 0
    for seed in range(size(80, 30)):
        rng = np.random.default_rng(seed)
        truth = true_arm(seed=seed)
        q, place = visits(rng, 40, times, 0.05 * DEG, reach=1.0)
        data = measured(len(q), q=q, truth=truth, sigma=sigma, seed=seed, stated=bool(seed % 2))
        obs = data.observations[0]
        data = replace(data, observations=(replace(obs, value=obs.value + tau * rng.normal(size=(40, 3))[place]),))
        for p in identify(arm(), data, Options(hold_out=0.0, leave_one_out=False)).parameters:
            if p.status == "identified" and p.interval and p.name in truth.table:
                inside += p.interval[0] <= truth.table[p.name].value <= p.interval[1]
                total += 1
    error = np.sqrt(0.05 * 0.95 / size(80, 30))
    print(f"coverage {inside / total:.3f} of {total}, Monte Carlo error {error:.3f}")
    assert 0.95 - 2 * error < inside / total < 0.95 + 2 * error


@pytest.mark.sampled(1)
@pytest.mark.parametrize("degrees", ["1R2T", "3R3T"])
def test_places_of_a_cable_robot_count_once_too(degrees):
    """Encoders and an instrument that err by place at a robot that is as drawn: not improved; at one that is not: improved."""
    for seed in range(size(10, 1)):
        for wrong in (False, True):
            rng = np.random.default_rng(seed)
            robot, truth, once = cables(degrees, rng, 26)
            truth = truth if wrong else robot
            many = np.repeat(np.arange(26), 4)
            pose = once.configurations.start
            start = pose[many] + 5e-4 * rng.normal(size=(104, 6)) * (np.ptp(pose, axis=0) > 0)
            asked = replace(cables(degrees, rng, 104)[2], configurations=where(None, start=start))
            data = synthesise(truth, asked, rng)
            seen = []
            for obs in data.observations:
                per = len(obs) // 104
                off = (2e-3 if obs.kind == "lengths" else 5e-4) * rng.normal(size=(26, per, obs.value.shape[1]))
                seen.append(replace(obs, value=obs.value + off[many].reshape(obs.value.shape)))
            found = identify(robot, replace(data, observations=tuple(seen)), Options(seed=seed))
            assert (found.verdict.status == "improved") is wrong


LOOK_LIKE_CHANGES = ("segment", "residual-grows", "errors-follow", "scale-of-drums", "wrong-time", "time-offset")


def again(count, times, order, rng):
    """Rows of a set of places one after the other, or mixed: which row comes when."""
    return {"consecutive": np.arange(count * times), "shuffled": rng.permutation(count * times)}[order]


def in_order(data, rows):
    """The same measurements in another order."""
    c = data.configurations
    seen = []
    for o in data.observations:
        per = len(o) // len(rows)
        at = (rows[:, None] * per + np.arange(per)).ravel()
        extra = {k: v[at] for k, v in o.extra.items()}
        seen.append(replace(o, value=o.value[at], sigma=None if o.sigma is None else o.sigma[at], extra=extra))
    q, start = (None if v is None else v[rows] for v in (c.joints, c.start))
    return DataSet(where(q, start), tuple(seen))


def suspected(found, codes=LOOK_LIKE_CHANGES):
    """Whether anything was taken for a change in time or of a scale."""
    told = {str(r.code) for r in (*found.verdict.reasons, *found.warnings)}
    return found.verdict.status == "refused" or any(c.startswith(codes) for c in told)


@pytest.mark.parametrize("order", ["consecutive", "shuffled"])
@pytest.mark.parametrize(("count", "times"), [(12, 10), (5, 30), (25, 4)])
def test_places_in_a_row_are_taken_for_nothing_that_changed(count, times, order):
    """What is left at a place ends where the next place begins: no step, no drift, no scale."""
    draws = size(40, 4)
    wrong = 0
    for seed in range(draws):
        rng = np.random.default_rng(700 + seed)
        off = {"wrong": 2e-3 * (seed % 2), "tau": 4e-4 if seed % 4 < 2 else 1e-4}
        robot, data, _ = recorded(rng, count, times, stated=seed % 3 > 0, **off)
        wrong += suspected(identify(robot, in_order(data, again(count, times, order, rng)), Options(seed=seed)))
    assert wrong <= max(0.03 * draws, 0)


@pytest.mark.parametrize("degrees", ["1R2T", "3R3T"])
def test_places_in_a_row_of_a_cable_robot_are_taken_for_nothing_that_changed(degrees):
    wrong, scales, draws = 0, 0, size(20, 2)
    for seed in range(draws):
        rng = np.random.default_rng(1000 + seed)
        robot, truth, once = cables(degrees, rng, 12)
        many, pose = np.repeat(np.arange(12), 10), once.configurations.start
        start = pose[many] + 5e-4 * rng.normal(size=(120, 6)) * (np.ptp(pose, axis=0) > 0)
        asked = replace(cables(degrees, rng, 120)[2], configurations=where(None, start=start))
        seen = []
        for obs in synthesise(truth if seed % 2 else robot, asked, rng).observations:
            per = len(obs) // 120
            off = (2e-3 if obs.kind == "lengths" else 5e-4) * rng.normal(size=(12, per, obs.value.shape[1]))
            seen.append(replace(obs, value=obs.value + off[many].reshape(obs.value.shape)))
        found = identify(robot, replace(asked, observations=tuple(seen)), Options(seed=seed))
        wrong += suspected(found, tuple(c for c in LOOK_LIKE_CHANGES if c != "scale-of-drums"))
        scales += suspected(found)
    assert wrong <= 0.03 * draws
    # A scale is remarked on from two sigma: chance alone says so once in 22 draws.
    assert scales <= binom.ppf(0.99, draws, 2 * norm.sf(2.0))


@pytest.mark.parametrize("order", ["consecutive", "shuffled"])
@pytest.mark.parametrize(("count", "times"), [(25, 4), (20, 20)])
def test_a_tracker_that_moved_among_visits_is_found(count, times, order):
    """By 3 mm after half of the rows, where places are off by 0.1 mm."""
    found = 0
    draws = size(20, 3)
    for seed in range(draws):
        rng = np.random.default_rng(800 + seed)
        robot, data, _ = recorded(rng, count, times, wrong=2e-3, tau=1e-4)
        data = in_order(data, again(count, times, order, rng))
        obs, way = data.observations[0], rng.normal(size=3)
        later = (np.arange(len(obs)) >= len(obs) // 2)[:, None]
        value = obs.value + later * 3e-3 * way / np.linalg.norm(way)
        done = identify(robot, replace(data, observations=(replace(obs, value=value),)), Options(seed=seed))
        found += any(str(r.code).startswith("segment") for r in done.verdict.reasons)
    assert found >= 0.95 * draws


@pytest.mark.parametrize("near", [2e-4, 0.01, 0.3])
def test_rows_are_linked_as_one_by_one_pairs_would(near):
    """Lists, revisited places, walks and a grid; every pair looked at, and links followed one row at a time."""
    rng = np.random.default_rng(4)
    lists = [rng.normal(size=(60, n)) for n in (1, 2, 6)]
    walks = [np.cumsum(rng.normal(size=(90, n)) * near, axis=0) for n in (1, 3, 6)]
    again = np.repeat(rng.normal(size=(20, 4)), 4, axis=0) + rng.normal(size=(80, 4)) * near / 2
    for place in (*lists, *walks, again, rng.integers(0, 9, (80, 2)) * near, np.zeros((5, 3))):
        linked = np.abs(place[:, None] - place).max(axis=2) <= near
        label = np.arange(len(place))
        while ((lower := np.where(linked, label, len(place)).min(axis=1)) < label).any():
            label = lower
        same = joined(where(place), near)
        np.testing.assert_array_equal(same[:, None] == same, label[:, None] == label)
