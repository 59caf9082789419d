"""Identification with several instruments and targets, known frames, a camera alone, and data of two shapes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from unit.arm_data import FREE, TRACKER, arm, away, blank, measured, observe, true_arm

from robocal.errors import Cancelled, ModelError
from robocal.fit.options import Options
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.prove.identify import identify

TRUTH = true_arm()


def several(rng):
    """Two trackers with frames of their own, two reflectors, one of them turned away half of the time."""
    m = 50
    other = Frame("second", (-1.0, 1.5, 0.2, 0.3, -0.1, -2.0), (True,) * 6)
    balls = (
        Frame("near", (0.0, 0, 0.05, 0, 0, 0), (True,) * 3 + (False,) * 3, "tool"),
        Frame("far", (0.08, 0.03, 0.15, 0, 0, 0), (True,) * 3 + (False,) * 3, "tool"),
    )
    where = Configurations(tuple(f"p{i}" for i in range(m)), rng.uniform(-1, 1, (m, 5)))
    first = observe("position", m, 2e-5, TRACKER, balls, rng.integers(0, 2, m))
    second = replace(observe("pose", m, 5e-5, other, (balls[1],), np.zeros(m, dtype=int)))
    truth = true_arm(robot=arm(free=FREE))
    data = synthesise(truth, DataSet(where, (first, second)), rng)
    return truth, DataSet(
        where,
        tuple(replace(o, frame=blank(o.frame), targets=tuple(blank(t) for t in o.targets)) for o in data.observations),
    )


def test_several_instruments_and_targets(rng):
    truth, data = several(rng)
    found = identify(arm(free=FREE), data)
    assert found.verdict.status == "improved" and away(found, truth) < 1e-4
    assert {(g.name, g.unit) for g in found.groups} == {("tracker", "m"), ("second", "m"), ("second", "rad")}
    assert set(found.rows.target) == {"near", "far"} and set(found.rows.group) == {"tracker", "second"}
    constant = found.stages[0].constant
    # The mean of two instruments' coordinates means nothing: each target of each instrument has its own.
    assert constant is not None and constant.n == found.stages[0].held_out.n
    # Every row carries the name of the target that it saw.
    by_kind = {}
    for o in data.observations:
        for c, t in zip(o.configuration, o.target, strict=True):
            by_kind[o.kind, f"p{c}"] = o.targets[t].name
    assert all(
        by_kind[k, c] == t for k, c, t in zip(found.rows.kind, found.rows.configuration, found.rows.target, strict=True)
    )


def test_a_fixed_frame_is_believed():
    known = replace(TRACKER, free=(False,) * 6)
    found = identify(arm(), measured(60, frame=known))
    by = {p.name: p for p in found.parameters}
    assert (
        found.verdict.status == "improved"
        and by["tracker.rx"].status == "fixed"
        and by["tracker.rx"].identified == TRACKER.value[3]
    )
    bare = identify(arm(), measured(60, frame=None))
    assert bare.verdict.status == "improved" and not any(p.name.startswith("tracker") for p in bare.parameters)


@pytest.mark.slow
def test_a_camera_alone_is_judged_in_pixels(rng):
    from measure.scenarios import CAMERA

    tags = tuple(
        Frame(f"tag{i}", (0.25 + 0.12 * i, 0.1 * i - 0.1, -0.45, 0.1, 0.1 * i, 0.2), (True,) * 6) for i in range(3)
    )
    hand = Frame("hand", (0.03, 0.01, 0.02, 0.05, -0.04, 0.8), (True,) * 6, "tool")
    m, square = 36, 0.05 * np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]])
    q = rng.uniform(-0.3, 0.3, (m, 5)) + [0, 0.2, 0.9, 1.9, 0]
    obs = Observations(
        "pixels", np.repeat(np.arange(m), 12), np.zeros((12 * m, 2)), np.full((12 * m, 2), 0.1), hand, tags, np.tile(np.repeat(np.arange(3), 4), m),
        {"point": np.tile(square, (3 * m, 1))}, {"camera": "lens", "intrinsics": CAMERA, "free": ()},
    )  # fmt: skip
    data = synthesise(TRUTH, DataSet(Configurations(tuple(map(str, range(m))), q), (obs,)), rng)
    near = tuple(replace(t, value=tuple(np.array(t.value) + rng.normal(0, 0.003, 6))) for t in tags)
    rough = DataSet(data.configurations, (replace(data.observations[0], targets=near),))
    for options in (Options(), Options(hold_out=0.0)):
        found = identify(arm(free=FREE), rough, options)
        assert found.verdict.status == "improved" and "px" in found.verdict.reasons[0].sentence
        assert [s.unit for s in found.stages] == ["px"] and found.stages[0].after.mean < 0.3 and found.band is None


def test_a_bar_without_joints_beside_a_tracker(rng):
    """Data of two shapes in one identification: the held-out units, the band and the warnings must bear configurations
    without joints."""
    ends = tuple(Frame(f"s{i}", (0.3 + 0.1 * i, 0, 0, 0, 0, 0), (True,) * 3 + (False,) * 3) for i in range(2))
    bar = Observations(
        "distance", np.arange(3), np.full((3, 1), 0.11), np.full((3, 1), 1e-5), options={"ends": ends}, group="bar"
    )
    found = identify(arm(), measured(40) + DataSet(Configurations(("a", "b", "c")), (bar,)))
    assert found.verdict.status == "improved" and np.isfinite(found.band.mean)
    by = {p.name: p.identified for p in found.parameters}
    assert np.linalg.norm([by[f"s0.{a}"] - by[f"s1.{a}"] for a in "xyz"]) == pytest.approx(0.11, abs=1e-4)
    columns = measured(20) + replace(
        measured(20, seed=4),
        configurations=replace(measured(20, seed=4).configurations, columns={"temperature": np.full(20, 20.0)}),
    )
    assert identify(arm(), columns).verdict.status == "improved"


def test_nothing_to_do_is_said():
    with pytest.raises(ModelError, match="nothing is free"):
        identify(arm(free=()), measured(10, frame=None))
    with pytest.raises(ModelError, match="no measurement"):
        identify(arm(), DataSet(measured(3).configurations, ()))


def test_progress_is_told_and_may_be_stopped():
    seen = []
    identify(arm(), measured(30), watch=seen.append)
    assert {"start", "iterate", "leave-one-out"} <= {e["stage"] for e in seen}

    def stop(event):
        raise Cancelled

    with pytest.raises(Cancelled):
        identify(arm(), measured(30), watch=stop)
