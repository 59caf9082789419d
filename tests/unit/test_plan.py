"""Planning of poses: regions are kept, the forecast comes true, the way is short."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from robocal.arms import catalog
from robocal.errors import ModelError
from robocal.estimate.least_squares import least_squares
from robocal.geometry import se3, so3
from robocal.measure.base import problem, synthesise
from robocal.measure.data import DataSet, Frame, Observations
from robocal.planning.candidates import Region, draw, joint_range, observe
from robocal.planning.design import blocks, predict_sigma, sum_information
from robocal.planning.pose_selection import Forecast, PlanOptions, plan
from robocal.planning.route import length, short_path, travel

RNG = np.random.default_rng
STANDS = (1.6, -1.1, 0.4, 0.02, -0.03, 2.1)
TRACKER = Frame("tracker", STANDS, (True,) * 6, expected=(10.0, 3.0))


def arm(name="rv-2aj"):
    chain = catalog.get(name)
    return replace(chain, table=chain.table.with_free([*chain.geometric, "tool.x", "tool.y", "tool.z"]))


def seen(kind="position", width=3, sigma=1e-4, frame=TRACKER, targets=()):
    target = np.zeros(1, dtype=np.int64) if targets else None
    zero = np.zeros(1, dtype=np.int64)
    return (Observations(kind, zero, np.zeros((1, width)), np.full((1, width), sigma), frame, targets, target),)


def test_candidates_stay_inside_the_limits_and_reach_them():
    chain = arm()
    low, high = joint_range(chain).T
    q = draw(chain, seen(), Region(), 500, RNG(0), edges=True)
    assert q.shape == (500, 5) and (q >= low).all() and (q <= high).all()
    assert ((q == low) | (q == high)).any(axis=0).all()
    plain = draw(chain, seen(), Region(), 500, RNG(0))
    assert ((plain > low) & (plain < high)).all()


def test_every_rule_of_a_region_is_kept():
    chain = arm()
    # A camera two metres above that looks down, and a marker that looks up.
    down = se3.compose(so3.exp(np.array([np.pi, 0.0, 0.0])), np.array([0.2, 0.0, 2.0]))
    camera = Frame("camera", tuple(se3.to_vector(se3.inverse(down))), (True,) * 6)
    flip = (0.0, 0.03, 0.05, 2.5, 0.0, 0.0)
    marker = Frame("marker", flip, (True,) * 6, mount="tool")
    region = Region(
        box=((-0.5, -0.5, 0.1), (0.5, 0.5, 0.8)),
        floor=0.15,
        pedestal=(0.12, 0.5),
        distance=(1.2, 1.8),
        cone=0.3,
        facing=0.9,
    )
    template = seen("pose", 6, frame=camera, targets=(marker,))
    q = draw(chain, template, region, 150, RNG(1))
    assert len(q) == 150
    pose = chain.pose(q)
    tip = pose[:, :3, 3]
    assert (tip >= region.box[0]).all() and (tip <= region.box[1]).all() and (tip[:, 2] >= 0.15).all()
    assert ((np.hypot(tip[:, 0], tip[:, 1]) >= 0.12) | (tip[:, 2] >= 0.5)).all()
    there = se3.from_vector(camera.value) @ pose @ se3.from_vector(flip)
    p = there[:, :3, 3]
    away = np.linalg.norm(p, axis=1)
    assert ((away >= 1.2) & (away <= 1.8)).all()
    assert (np.arccos(p[:, 2] / away) <= 0.3 + 1e-9).all()
    assert (np.arccos(-np.sum(there[:, :3, 2] * p, axis=1) / away) <= 0.9 + 1e-9).all()


def test_an_empty_region_names_the_rule():
    with pytest.raises(ModelError, match="box") as caught:
        draw(arm(), seen(), Region(box=((5.0, 5.0, 5.0), (6.0, 6.0, 6.0)), floor=0.0), 50, RNG(0))
    assert "100 %" in str(caught.value)
    with pytest.raises(ModelError, match="frame"):
        draw(arm(), seen(frame=None), Region(cone=0.5), 50, RNG(0))


def test_the_forecast_comes_true():
    """Robots that differ from the model as expected, measured at some poses, are predicted as well as foretold."""
    chain = arm()
    # Errors so small that the model is linear in them; the forecast is made for that.
    priors = {n: {"m": 3e-4, "rad": 5e-4}[chain.table[n].unit] for n in chain.table.free}
    chain = replace(chain, table=chain.table.with_priors(priors))
    q = draw(chain, seen(), Region(), 30, RNG(2))
    tests = draw(chain, seen(), Region(), 60, RNG(3))
    shown = seen()
    b = blocks(chain, shown, q, tests)
    foretold = predict_sigma(b.tests, sum_information(b, range(len(q))))
    ids = tuple(map(str, range(30)))
    made = problem(chain, observe(shown, q, ids, {}))
    batch = 200
    rng = RNG(4)
    free = [n for n in made.free if not n.startswith("tracker")]
    truth = np.repeat(made.start, batch, axis=0)
    for name in free:
        truth[:, made.table.index[name]] += chain.table[name].scale * rng.standard_normal(batch)
    value = np.array(
        [synthesise(chain, observe(shown, q, ids, {}), rng, x=x[None]).observations[0].value for x in truth]
    )
    data = observe(shown, q, ids, {})
    many = problem(chain, DataSet(data.configurations, (replace(data.observations[0], value=value),)))
    priors = {n: float(s) for n, s in zip(many.free, many.scales, strict=True)}
    solved = least_squares(many.with_table(many.table.with_priors(priors)), np.repeat(many.start, batch, axis=0))
    there = problem(chain, observe(shown, tests, tuple(map(str, range(60))), {}))
    true, found = (np.asarray(there.residuals(x)[0].value) for x in (truth, solved.x))
    error = np.sqrt(np.mean(np.sum((true - found) ** 2, axis=-1), axis=0))
    # 200 trials of about three axes scatter by 3 %, the tests share them.
    np.testing.assert_allclose(error.mean(), foretold.mean(), rtol=0.08)
    np.testing.assert_allclose(error, foretold, rtol=0.3)


def test_without_an_instrument_frame_the_points_are_aligned():
    """What a rigid motion of everything explains is nobody's error: turning the base changes no forecast."""
    chain = arm()
    place = Frame(
        "anchor", (0.6, 0.2, 0.1, 0.0, 0.0, 0.0), (True, True, True, False, False, False), expected=(1.0, 1.0)
    )
    bar = Observations(
        "distance", np.zeros(1, dtype=np.int64), np.zeros((1, 1)), np.full((1, 1), 1e-4),
        options={"ends": (place, Frame("ball", (0.0, 0.0, 0.05, 0.0, 0.0, 0.0), mount="tool"))},
    )  # fmt: skip
    q = draw(chain, (bar,), Region(), 40, RNG(5))
    b = blocks(chain, (bar,), q, q[:20])
    assert not any(n.startswith("aligned") for n in b.names)
    turn = b.names.index("j1.theta")
    # The first joint's zero turns the whole arm: aligned points do not move.
    assert np.abs(b.tests[:, :, turn]).max() < 1e-6 * np.abs(b.tests).max()


def test_a_plan_beats_random_poses_and_knows_it():
    chain = arm()
    found = plan(chain, seen(), PlanOptions(15, candidates=800, tests=80))
    f = found.forecast
    assert found.q.shape == (15, 5) and sorted(found.path.tolist()) == list(range(15))
    assert f.mean[15] < 0.85 * f.random[15] and (np.diff(f.mean) <= 1e-12).all() and (f.p95 >= f.mean).all()
    assert found.design.value >= found.design.start_value and found.limit is not None
    assert found.design.value <= found.limit < 0
    np.testing.assert_allclose(found.uncertainty, f.mean[15], rtol=0.05)
    again = plan(chain, seen(), PlanOptions(15, candidates=800, tests=80))
    np.testing.assert_array_equal(found.q, again.q)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("criterion", ["D", "A", "E", "G", "O1", "O2", "O3", "O4", "O5"])
def test_every_criterion_plans(criterion):
    found = plan(arm(), seen(), PlanOptions(12, criterion=criterion, candidates=300, tests=40))
    assert len(np.unique(found.design.chosen)) == 12 and found.design.value >= found.design.start_value


def test_enough_is_where_more_hardly_helps_or_the_accuracy_is_reached():
    count = np.arange(40)
    f = Forecast(count, 1.0 / np.sqrt(count + 1.0), 1.0 / np.sqrt(count + 1.0), count * 0.0)
    assert f.enough(0.05, 0.25) == 15
    assert f.enough(0.05, 0.1) is None
    assert f.enough(0.1, None) == next(k for k in count if 1 - np.sqrt((k + 1) / (k + 6)) < 0.1)
    asked = plan(arm(), seen(), PlanOptions(accuracy=1e-4, candidates=300, tests=40))
    n = len(asked.q)
    assert asked.enough == n and asked.forecast.mean[n] <= 1.02e-4 < asked.forecast.mean[n - 2]


def test_poses_measured_before_count():
    chain = arm()
    q = draw(chain, seen(), Region(), 20, RNG(6))
    done = observe(seen(), q, tuple(f"m{i}" for i in range(20)), {})
    options = PlanOptions(5, candidates=400, tests=60)
    alone, after = plan(chain, seen(), options), plan(chain, seen(), options, measured=done)
    assert after.measured == 20 and after.forecast.mean[5] < 0.5 * alone.forecast.mean[5]
    b = blocks(chain, seen(), q, after.tests)
    np.testing.assert_allclose(
        after.forecast.mean[0], predict_sigma(b.tests, sum_information(b, range(20))).mean(), rtol=1e-6
    )


def test_what_cannot_be_drawn_needs_a_list():
    chain = arm()
    place = Frame("plate", (0.3, 0.0, 0.1, 0.0, 0.0, 0.0), (False, False, True, True, True, False))
    plane = (replace(seen("plane", 1, frame=None)[0], options={"place": place}),)
    with pytest.raises(ModelError, match="list of poses"):
        plan(chain, plane, PlanOptions(5))
    q = draw(chain, seen(), Region(), 40, RNG(7))
    found = plan(chain, plane, PlanOptions(5, tests=30), listed=(tuple(map(str, range(40))), q))
    assert all(any((row == other).all() for other in q) for row in found.q)
    pair = (replace(seen("displacement")[0], second=np.zeros(1, dtype=np.int64)),)
    with pytest.raises(ModelError, match="two configurations"):
        plan(chain, pair, PlanOptions(5))


def test_the_way_is_short_and_visits_every_pose_once():
    rng = RNG(8)
    chain = arm()
    q = rng.uniform(-1, 1, (7, 5))
    d = travel(chain, q)
    order = short_path(d, 2)
    assert order[0] == 2 and sorted(order.tolist()) == list(range(7))
    best = min(length(d, np.array((2, *rest))) for rest in permutations([i for i in range(7) if i != 2]))
    assert length(d, order) <= 1.1 * best
    far = travel(chain, rng.uniform(-1, 1, (40, 5)))
    assert length(far, short_path(far, 0)) < 0.75 * length(far, np.arange(40))
    assert short_path(np.zeros((1, 1)), 0).tolist() == [0]
