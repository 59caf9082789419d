"""Readings of a moving arm that belong to another moment: refused with how far off they are, whatever is measured; silent otherwise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measure.rigs import recorded

from robocal.diagnose.path_rates import joint_rates
from robocal.files.robot import open_robot
from robocal.fit.options import Options
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet
from robocal.prove.identify import identify
from robocal.remarks.code import Code

CODES = (Code.LATE, Code.LATE_DOUBTED)
ROWS = 120


def path(rows):
    """Joint values (m, 6) along a path, one row at each of these times, which need be no whole numbers."""
    turn = 2 * np.pi * np.asarray(rows, dtype=float)[:, None] / ROWS
    return np.sin(turn * np.array([1, 1.7, 2.3, 1.1, 3.1, 2.1]) + 0.17 * np.arange(6)) * np.array(
        [1, 0.8, 0.7, 1, 1, 1]
    )


def run(kind="position", delay=0.0, time=None, shuffled=False, seed=0):
    """An arm with errors of 0.3 mm and 1 mrad on a path, read `delay` rows before its joint values were."""
    rng = np.random.default_rng(seed)
    nominal = open_robot("ur10").chain
    nominal = replace(nominal, table=nominal.table.with_free([n for n in nominal.usual if not n.startswith("tool.")]))
    scale = {"m": 3e-4, "rad": 1e-3}
    off = {n: nominal.table[n].value + rng.normal(0, scale[nominal.table[n].unit]) for n in nominal.geometric}
    truth = nominal.with_values(off)
    made = recorded(kind, truth, rng, ROWS, ROWS)
    order = rng.permutation(ROWS) if shuffled else np.arange(ROWS)
    moved = replace(made.configurations, joints=path(order - delay))
    read = synthesise(truth, DataSet(moved, made.observations), rng)
    columns = {} if time is None else {"time": time * order}
    told = DataSet(replace(read.configurations, joints=path(order), columns=columns), read.observations)
    found = identify(nominal, told, Options(leave_one_out=False))
    return found, [r for r in (*found.verdict.reasons, *found.warnings) if r.code in CODES]


@pytest.mark.parametrize("kind", ["position", "pose", "spherical"])
@pytest.mark.parametrize("delay", [0.1, -0.1])
def test_a_path_that_was_read_late_or_early_is_refused(kind, delay):
    found, told = run(kind, delay)
    assert found.verdict.status == "refused" and [r.code for r in told] == [Code.LATE]
    numbers = told[0].numbers
    assert numbers["before" if delay > 0 else "after"].value == pytest.approx(abs(delay), rel=0.1)
    assert numbers["after" if delay > 0 else "before"] is None


def test_with_times_it_is_told_in_seconds_whatever_the_order_of_the_rows():
    found, told = run(delay=0.1, time=0.25, shuffled=True)
    assert found.verdict.status == "refused"
    assert (told[0].numbers["before"].value, told[0].numbers["before"].unit) == (pytest.approx(0.025, rel=0.1), "s")


@pytest.mark.parametrize("kind", ["position", "pose", "spherical"])
def test_a_path_that_was_read_in_time_is_not_spoken_of(kind):
    found, told = run(kind)
    assert found.verdict.status == "improved" and not told


def test_poses_that_were_taken_one_by_one_have_no_pace():
    rng = np.random.default_rng(0)
    assert joint_rates(Configurations(tuple(map(str, range(60))), rng.uniform(-1, 1, (60, 6)))) is None
    assert joint_rates(Configurations(tuple(map(str, range(60))), np.zeros((60, 6)))) is None
    assert joint_rates(Configurations(tuple(map(str, range(ROWS))), path(np.arange(ROWS)))) is not None
