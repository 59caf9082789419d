"""Outliers by name: found, not invented, leverage undone, and not hidden by each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from unit.arm_data import FREE, arm, measured

from robocal.fit.options import Options
from robocal.measure.data import DataSet, Frame
from robocal.prove.identify import identify
from robocal.remarks.code import Code

FAST = Options(hold_out=0.0, leave_one_out=False)


def spoiled(data, shifts):
    """The data with some rows moved (m)."""
    obs = data.observations[0]
    value = np.array(obs.value)
    for row, shift in shifts.items():
        value[row] += shift
    return replace(
        data, observations=(replace(obs, value=value, rows=np.arange(len(obs)) + 2, source="folder/tracker.csv"),)
    )


@pytest.mark.parametrize("stated", [True, False])
def test_gross_rows_are_named_and_the_others_are_not(stated):
    data = spoiled(measured(60, stated=stated), {7: [3e-3, 0, 0], 23: [0, -4e-4, 0], 41: [0, 0, 6e-4]})
    found = identify_of(data)
    assert [(o.configuration, o.row) for o in found] == [("p7", 9), ("p41", 43), ("p23", 25)]
    assert all(o.source == "folder/tracker.csv" and o.p_value < 1e-6 and 0 < o.leverage < 1 for o in found)
    # Distances are those of a prediction without the row: 3 mm at 0.02 mm noise, less what the prediction adds.
    assert 100 < found[0].distance < 160 and found[0].distance / found[2].distance == pytest.approx(7.5, rel=0.25)


def test_many_outliers_do_not_hide_each_other():
    rng = np.random.default_rng(2)
    bad = rng.choice(60, 8, replace=False)
    found = identify_of(spoiled(measured(60, stated=False), {int(i): rng.normal(0, 3e-3, 3) for i in bad}))
    assert {o.configuration for o in found} == {f"p{i}" for i in bad}


@pytest.mark.slow
def test_clean_data_are_seldom_accused():
    """One data set in a hundred may name a row; of 60, more than 4 would be three in a thousand."""
    accused = sum(bool(identify_of(measured(40, seed=s, stated=s % 2 == 0))) for s in range(60))
    print(f"rows named in {accused} of 60 clean data sets")
    assert accused <= 4


def test_a_robust_fit_names_the_same_rows():
    data = spoiled(measured(60), {7: [3e-3, 0, 0]})
    names = [o.configuration for o in identify(*arm_and(data), replace(FAST, loss="cauchy")).outliers]
    assert names == ["p7"]


def arm_and(data):
    from unit.arm_data import arm

    return arm(), data


def identify_of(data):
    return identify(*arm_and(data), FAST).outliers


def test_swapped_target_labels_are_told_by_the_target():
    """Three reflectors on one flange; two rows have the name of another."""
    places = {"a": (0.05, 0, 0), "b": (-0.03, 0.04, 0.02), "c": (0, -0.05, 0.03)}
    targets = tuple(Frame(n, (*p, 0, 0, 0), (True,) * 3 + (False,) * 3, mount="tool") for n, p in places.items())
    data = spoiled(measured(60, targets=targets, target=np.arange(60) % 3), {})
    obs = data.observations[0]
    named = np.array(obs.target)
    named[[7, 30]] = 2, 1
    robot = arm(free=FREE)
    found = identify(robot, replace(data, observations=(replace(obs, target=named),)), FAST).outliers
    assert {o.row: (o.cause.code, o.cause.numbers["target"]) for o in found} == {
        9: (Code.ROW_TARGET, "b"),
        32: (Code.ROW_TARGET, "a"),
    }


def test_coarsely_rounded_rows_are_not_gross():
    """Noise-free, five significant digits: joints beyond 100 degrees are rounded ten times more coarsely than the others, and
    two rows have three of them."""
    blind = 0
    for seed in range(5):
        rng = np.random.default_rng(seed)
        q = rng.uniform(11, 60, (60, 5)) * rng.choice([-1, 1], (60, 5))
        q[[4, 20], :3] = rng.uniform(100, 150, (2, 3))
        h = 10.0 ** (np.floor(np.log10(np.abs(q))) - 4)
        data = measured(noise=0.0, stated=False, q=np.deg2rad(q))
        said = replace(data.configurations, joints=np.deg2rad(np.round(q / h) * h), digits=np.deg2rad(h))
        assert identify(arm(), DataSet(said, data.observations), FAST).outliers == ()
        blind += len(identify(arm(), DataSet(replace(said, digits=None), data.observations), FAST).outliers)
        # A row that is off by more than its own digits say is gross all the same.
        off = spoiled(DataSet(said, data.observations), {4: [2e-3, 0, 0], 11: [0, 2e-4, 0]})
        assert {o.row for o in identify(arm(), off, FAST).outliers} == {6, 13}
    assert blind
