"""A load that bends a joint to its other side looks as if a target had moved: named with both explanations, and a doubt; a target that
moved stays refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from trials import TRACKER, observations, open_robot, perturbed

from robocal.arms.groups import add as with_group
from robocal.fit.options import Options
from robocal.geometry import se3
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet
from robocal.measure.reach import places_by_joints
from robocal.prove.identify import identify
from robocal.remarks.code import Code

ROWS = 120
CODES = (Code.SEGMENT, Code.SEGMENT_OF_TARGET, "moved-or-bent")


def judged(profile, seed=0, order=None, again=None, up=2, robot=None):
    """A UR10 at places in `order` of their joint values, with its target off by 4 mm on the rows of a profile (q, rise of j2) -> (m,); in a
    second file at the same places in any order, off by the profile `again`. Upwards is an axis of its base."""
    rng = np.random.default_rng(seed)
    robot = robot or open_robot("ur10").chain
    q = rng.uniform(-1.2, 1.2, (ROWS, 6)) + [0, -np.pi / 2, 0, 0, 0, 0]
    step = np.array([0, 1e-4, 0, 0, 0, 0])
    rise = (places_by_joints(robot, q + step) - places_by_joints(robot, q - step))[:, up]
    q, rise = (v[order(q, rise)] for v in (q, rise)) if order else (q, rise)
    true = perturbed(robot, rng)
    where = Configurations(tuple(map(str, range(ROWS))), q)
    data = synthesise(true, DataSet(where, (observations("position", ROWS),)), rng)
    obs, value = data.observations[0], data.observations[0].value.copy()
    turn = se3.from_vector(np.array(TRACKER.value))[:3, :3] @ true.pose(q)[:, :3, :3]
    value[:, :3] += profile(q, rise)[:, None] * (turn @ [0.0, 0.0, 4e-3])
    read = replace(data, observations=(replace(obs, value=value, source="a.csv"),))
    if again is not None:
        mixed = rng.permutation(ROWS)
        other = replace(obs, value=value - profile(q, rise)[:, None] * (turn @ [0.0, 0.0, 4e-3]))
        moved = other.value[mixed] + again(q, rise)[mixed, None] * (turn @ [0.0, 0.0, 4e-3])[mixed]
        moved = moved + 4e-5 * rng.normal(size=moved.shape)
        both = Configurations(tuple(map(str, range(2 * ROWS))), np.concatenate([q, q[mixed]]))
        second = replace(obs, configuration=np.arange(ROWS, 2 * ROWS), value=moved, source="b.csv")
        read = DataSet(both, (*read.observations, second))
    found = identify(robot, read, Options(leave_one_out=False))
    return found.verdict, [r for r in (*found.verdict.reasons, *found.warnings) if r.code in CODES]


def twice(q, rise):
    """Down, up and down again: the load of j2 changes its side and comes back."""
    up, down = np.flatnonzero(rise > 0), np.flatnonzero(rise <= 0)
    return np.concatenate([down[: len(down) // 2], up, down[len(down) // 2 :]])


@pytest.mark.sampled(1)
@pytest.mark.parametrize("seed", range(2))
def test_a_joint_that_bends_to_its_other_side_is_a_doubt(seed):
    for order in (twice, lambda q, rise: np.argsort(rise > 0, kind="stable")):
        verdict, told = judged(lambda q, rise: rise > 0, seed, order)
        assert told and {r.code for r in told} == {"moved-or-bent"} and verdict.status != "refused"
        assert all(r.numbers["joint"] == "j2" for r in told)


@pytest.mark.sampled(1)
@pytest.mark.parametrize("seed", range(2))
def test_what_crossing_back_does_not_undo_has_moved(seed):
    """The same order of places, and the target off from the middle on; and places in any order."""
    for order in (twice, None):
        verdict, told = judged(lambda q, rise: np.arange(ROWS) >= ROWS // 2, seed, order)
        assert verdict.status == "refused" and Code.SEGMENT in {r.code for r in told}
        assert "moved-or-bent" not in {r.code for r in told}


def apart(q, rise):
    """All places of one side, then all of the other: time alone tells a knock from a load."""
    return np.argsort(rise > 0, kind="stable")


@pytest.mark.sampled(1)
@pytest.mark.parametrize("seed", [1, 2])
def test_another_run_over_the_same_places_shows_that_a_joint_bends(seed):
    verdict, told = judged(lambda q, rise: rise > 0, seed, apart, lambda q, rise: rise > 0)
    assert told and {r.code for r in told} == {"moved-or-bent"} and verdict.status != "refused"


# obeys: moved-or-bent
@pytest.mark.sampled(1)
@pytest.mark.parametrize("seed", range(3))
def test_another_run_over_the_same_places_shows_that_something_moved(seed):
    """It does not go with the joint's region in a run that was made before the knock."""
    verdict, told = judged(lambda q, rise: rise > 0, seed, apart, lambda q, rise: np.zeros(len(q)))
    assert verdict.status == "refused" and {r.code for r in told} == {Code.SEGMENT}


@pytest.mark.sampled(1)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_run_after_the_knock_is_no_proof_of_bending(seed):
    verdict, told = judged(lambda q, rise: rise > 0, seed, apart, lambda q, rise: np.ones(len(q)))
    assert verdict.status == "refused" and "moved-or-bent" not in {r.code for r in told}


def test_up_is_where_the_robot_says():
    """An arm on a wall: its group states gravity, and a moment about it bends; without that statement, one crossing says nothing."""
    robot = open_robot("ur10").chain
    wall = with_group(robot, "sag", {"gravity": (0.0, -9.81, 0.0)})
    profile = lambda q, rise: rise > 0  # noqa: E731
    assert {r.code for r in judged(profile, 0, apart, up=1, robot=wall)[1]} == {"moved-or-bent"}
    assert judged(profile, 0, apart, up=1, robot=robot)[0].status == "refused"
