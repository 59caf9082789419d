"""What makes a row strange is named where it can be told, and nothing is said where it cannot."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.diagnose.outliers import causes_of
from robocal.remarks.code import Code

SIGMA = np.full(3, 1e-4)


@pytest.fixture
def clean(rng):
    """300 readings of places in a cubic metre, and what is predicted of them."""
    predicted = rng.uniform(-0.5, 0.5, (300, 3))
    return predicted + rng.normal(size=predicted.shape) * SIGMA, predicted


def test_each_cause(clean):
    value, predicted = clean
    value[10] = 0.0
    value[21] = value[20]
    value[[30, 40]] = value[[40, 30]]
    value[[50, 60, 70]] = value[[60, 70, 50]]
    value[81:84, 1] = value[80:83, 1]
    value[90, 2] = -value[90, 2]
    value[95, 0] += 0.013
    value[99] += [0.02, -0.03, 0.01]
    flagged = np.array([10, 21, 30, 40, 50, 60, 70, 81, 82, 83, 90, 95, 99])
    named = {n.row: n for n in causes_of(flagged, value, predicted, SIGMA)}
    assert {r: n.cause for r, n in named.items()} == {
        21: Code.ROW_COPY,
        **dict.fromkeys((30, 40), Code.ROW_SWAPPED),
        **dict.fromkeys((50, 60, 70), Code.ROW_ELSEWHERE),
        **dict.fromkeys((81, 82, 83), Code.ROW_SHIFTED),
        90: Code.ROW_SIGN,
        95: Code.ROW_COLUMN,
    }
    assert [named[r].partner for r in (21, 30, 40, 50, 60, 70, 82)] == [20, 40, 30, 60, 70, 50, 81]
    assert [named[r].column for r in (82, 90, 95)] == [1, 2, 0]
    said = named[30].remark(np.arange(300) + 2)
    assert said.code is Code.ROW_SWAPPED and said.sentence.startswith("rows 32 and 42")


def test_two_labels_swapped(rng):
    of_targets = rng.uniform(-0.5, 0.5, (50, 1, 3)) + np.array([[0, 0, 0], [0.05, 0, 0], [0, 0.05, 0]])
    target = np.arange(50) % 3
    value = of_targets[np.arange(50), target] + rng.normal(size=(50, 3)) * SIGMA
    value[7] = of_targets[7, 2]
    predicted = of_targets[np.arange(50), target]
    (named,) = causes_of(np.array([7]), value, predicted, SIGMA, of_targets=of_targets, target=target)
    assert (named.cause, named.target) == (Code.ROW_TARGET, 2)
    assert "target c" in named.remark(targets=("a", "b", "c")).sentence


def test_nothing_is_said_by_chance(clean, rng):
    """Gross errors of any size are no cause; nor is any where places lie closer together than the noise."""
    value, predicted = clean
    some = rng.choice(300, 60, replace=False)
    value[some] += rng.normal(size=(60, 3)) * 0.1
    assert len(causes_of(some, value, predicted, SIGMA)) <= 1
    crowded = predicted * 2e-3
    value = crowded + rng.normal(size=crowded.shape) * SIGMA
    value[some] = value[rng.permutation(some)] + SIGMA * 3
    assert not [n for n in causes_of(some, value, crowded, SIGMA) if n.cause in (Code.ROW_SWAPPED, Code.ROW_ELSEWHERE)]


def test_shuffled_rows_of_a_tracker(shared_data, tmp_path):
    """UR10, series C, with 3 % of its readings swapped in pairs: all are named, with their partners."""
    from dataclasses import replace

    from real.test_ur10 import EXAMPLE, FILES

    from robocal.estimate.least_squares import least_squares
    from robocal.files.dataset import read_dataset
    from robocal.files.robot import read_robot
    from robocal.fit.baseline import baseline
    from robocal.measure.base import problem

    text = (EXAMPLE / "data.yaml").read_text()
    csv = str(shared_data / "ur10-laser-tracker" / FILES["C"])
    (tmp_path / "data.yaml").write_text(text.replace("measurements_random_poses.csv", csv))
    robot = read_robot(EXAMPLE / "robot.yaml").chain
    data = read_dataset(tmp_path / "data.yaml", robot).dataset
    obs = data.observations[0]
    pairs = np.random.default_rng(3).choice(len(obs), (42, 2), replace=False)
    value = obs.value.copy()
    value[pairs] = value[pairs[:, ::-1]]
    swapped = replace(data, observations=(replace(obs, value=value, sigma=np.full((len(obs), 3), 3e-4)),))
    _, x = baseline(robot, swapped, np.arange(len(obs)))
    made = problem(robot, swapped).with_loss("huber")
    found = least_squares(made.with_loss("tukey"), least_squares(made, x).x)
    predicted = made.terms[0].predict(found.x)
    spread = np.median(np.abs(value - predicted), axis=0) / 0.6745
    named = {n.row: n for n in causes_of(np.sort(pairs.ravel()), value, predicted, spread)}
    right = [
        named[i].cause is Code.ROW_SWAPPED and named[i].partner == j
        for a, b in pairs
        for i, j in ((a, b), (b, a))
        if i in named
    ]
    print(f"\n{sum(right)} of {pairs.size} swapped rows named with their partner")
    assert len(right) == sum(right) == pairs.size
