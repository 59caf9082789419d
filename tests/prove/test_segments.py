"""Change points: a moved target or instrument is found, where it happened and what it was; nothing else is one."""

from __future__ import annotations

import os
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from sizes import size
from trials import ROBOTS, TRACKER, joints, observations, open_robot, perturbed

from robocal.diagnose.segments import find
from robocal.diagnose.segments.find import find_segments
from robocal.diagnose.segments.running_sums import SegmentScan
from robocal.diagnose.segments.tell import segment_remarks
from robocal.fit.baseline import baseline
from robocal.geometry import se3
from robocal.measure.base import synthesise
from robocal.measure.data import DataSet, Frame
from robocal.remarks.code import Code

TRIALS = int(os.environ.get("ROBOCAL_TRIALS", "4"))
STEP = 5e-3


def rig(name, kind, m, rng, stated=True):
    robot = open_robot(name).chain
    true = perturbed(robot, rng)
    data = synthesise(true, DataSet(joints(robot, rng, m), (observations(kind, m),)), rng)
    obs = data.observations[0]
    return robot, true, data if stated else replace(data, observations=(replace(obs, sigma=None),))


def moved(true, data, profile, step, cause="target"):
    """The same readings where the target (tool axes) or the instrument (its own) stood off by a share of a step (m)."""
    obs = data.observations[0]
    turn = se3.from_vector(np.array(TRACKER.value))[:3, :3] @ true.pose(data.configurations.joints)[:, :3, :3]
    away = turn @ step if cause == "target" else np.tile(step, (len(obs), 1))
    value = obs.value.copy()
    value[:, :3] += profile[:, None] * away
    return replace(data, observations=(replace(obs, value=value),))


def searched(robot, data):
    problem, x = baseline(robot, data, np.arange(len(data.configurations)))
    return find_segments(robot, data, dict(zip(problem.table.names, x[0], strict=False)))


def direction(rng):
    v = rng.normal(size=3)
    return STEP * v / np.linalg.norm(v)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "m"), [("position", 30), ("position", 100), ("pose", 50)])
@pytest.mark.parametrize("name", ROBOTS)
def test_what_moved_is_found(name, kind, m):
    rng = np.random.default_rng(m)
    hits, exact, total = 0, 0, 0
    for k in range(TRIALS):
        robot, true, data = rig(name, kind, m, rng, stated=k % 2 == 0)
        for cause in ("target", "instrument"):
            first = int(rng.integers(m // 4, 3 * m // 4))
            found = searched(robot, moved(true, data, np.arange(m) >= first, direction(rng), cause))
            total += 1
            hits += bool(found) and found[0].cause == cause
            exact += len(found) == 1 and abs(found[0].first - first) <= 1 and found[0].last == m - 1
    print(f"\n{name}, {m} {kind}: {hits} of {total} named rightly, {exact} within one row")
    assert hits >= 0.95 * total and exact >= 0.95 * total


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_nothing_else_is_a_segment(name):
    """Clean files, warmth, drift, heavy tails and gross rows."""
    rng = np.random.default_rng(7)
    spoken = dict.fromkeys(("clean", "drift", "warm", "walk", "tails", "gross"), 0)
    for k in range(2 * TRIALS):
        kind, m = [("position", 30), ("position", 50), ("pose", 30), ("pose", 50)][k % 4]
        robot, true, data = rig(name, kind, m, rng, stated=k % 2 == 0)
        obs, t = data.observations[0], np.arange(m) / m
        tails, gross = obs.value.copy(), obs.value.copy()
        tails[:, :3] += 5e-5 * rng.standard_t(2, size=(m, 3))
        some = rng.choice(m, int(rng.integers(1, 6)), replace=False)
        gross[some, :3] += rng.normal(size=(len(some), 3)) * rng.choice([5e-3, 0.05, 0.5])
        cases = {
            "clean": data,
            "drift": moved(true, data, t, np.array([1e-3, 0, 0]), "instrument"),
            "warm": moved(true, data, 1 - np.exp(-t / 0.15), np.array([0, 0, 1e-3])),
            "walk": moved(true, data, np.cumsum(rng.normal(size=m)) / np.sqrt(m), np.array([0, 0, 3e-4]), "instrument"),
            "tails": replace(data, observations=(replace(obs, value=tails),)),
            "gross": replace(data, observations=(replace(obs, value=gross),)),
        }
        for what, some_data in cases.items():
            spoken[what] += bool(searched(robot, some_data))
    print(f"\n{name}: {spoken} of {2 * TRIALS} files each")
    assert spoken["clean"] == spoken["drift"] == spoken["tails"] == spoken["warm"] == 0
    # A random walk takes steps, and one gross row in five may draw its neighbours along.
    assert spoken["gross"] + spoken["walk"] <= 0.02 * 2 * TRIALS


def test_rows_in_the_middle_and_of_one_target(rng):
    """Of two targets one was knocked; only its rows are off, and only they are counted."""
    robot = open_robot("ur10").chain
    true = perturbed(robot, rng)
    m = 80
    balls = tuple(
        Frame(f"ball{i}", (0.05 * i, 0.1, 0.1, 0, 0, 0), (True,) * 3 + (False,) * 3, "tool", (0.2, 3.0)) for i in (1, 2)
    )
    obs = replace(observations("position", m), targets=balls, target=np.arange(m) % 2, rows=np.arange(m) + 2)
    data = synthesise(true, DataSet(joints(robot, rng, m), (obs,)), rng)
    knocked = (np.arange(m) >= 30) & (np.arange(m) < 60) & (np.arange(m) % 2 == 1)
    (found,) = searched(robot, moved(true, data, knocked, np.array([0, STEP, 0])))
    assert (found.cause, found.name, found.count) == ("target", "ball2", 15)
    assert found.rows == (33, 61) and found.shift == pytest.approx(STEP, rel=0.1)
    (remark,) = segment_remarks((found,))
    assert remark.code is Code.SEGMENT_OF_TARGET and remark.numbers["target"] == "ball2"
    assert "--exclude 33-61" in remark.advice


def test_rows_that_do_not_count_say_nothing(rng):
    robot, true, data = rig("rv-2aj", "position", 60, rng)
    half = moved(true, data, np.arange(60) >= 30, np.array([STEP, 0, 0]))
    problem, x = baseline(robot, half, np.arange(60))
    start = dict(zip(problem.table.names, x[0], strict=False))
    assert find_segments(robot, half, start)
    assert not find_segments(robot, half, start, (np.arange(60) < 30)[None].astype(float))


def test_noise_free_numbers_are_no_steps(rng):
    robot = open_robot("ur10").chain
    true = perturbed(robot, rng)
    data = synthesise(true, DataSet(joints(robot, rng, 60), (replace(observations("position", 60), sigma=None),)))
    assert not searched(robot, data)


def test_where_all_together_are_small_none_is_named_beside_the_others(monkeypatch):
    """No bound says so: steps of all sizes about the least that is named, searched with and without the early end."""
    rng, early = np.random.default_rng(11), []
    little = find._are_small

    def goes_on(*asked):
        early.append(bool(asked[1]) and little(*asked))
        return False

    for k in range(size(4000, 50)):
        m = int(rng.integers(30, 90))
        robot, true, data = rig(ROBOTS[k % len(ROBOTS)], ["position", "pose"][k % 2], m, rng, stated=k % 3 == 0)
        for _ in range(int(rng.integers(1, 4))):
            first, last = np.sort(rng.integers(0, m, 2))
            step = direction(rng) / STEP * 10 ** rng.uniform(-4.3, -2.8)
            profile = (np.arange(m) >= first) & (np.arange(m) < last + 5)
            data = moved(true, data, profile, step, ["target", "instrument"][int(rng.integers(2))])
        with monkeypatch.context() as patch:
            patch.setattr(find, "_are_small", goes_on)
            whole = searched(robot, data)
        assert [(s.cause, s.first, s.last) for s in searched(robot, data)] == [
            (s.cause, s.first, s.last) for s in whole
        ]
    assert sum(early) > 0.05 * len(early) > 1


def test_the_search_of_a_long_file_takes_little_memory():
    """The products of all ends, of which one is fixed, were 20 GB for 10^5 rows: sums are made where they are asked."""
    rng, k = np.random.default_rng(2), 4000
    left = rng.normal(size=(k, 3))
    left[1203:2418] += 0.3
    some = np.tile(np.eye(3), (k, 1, 1)), left, np.ones((k, 1)), [rng.normal(size=(k, 3, 20))], 0.02 * np.eye(20)
    tracemalloc.start()
    first, last = SegmentScan(*some).find()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 10e6
    assert abs(first - 1203) < 20 and abs(last - 2418) < 20
