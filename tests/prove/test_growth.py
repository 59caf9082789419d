"""What is left that grows along a file is told with its size and with the error to expect afterwards; nothing else is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cables.logs import Log
from measure.rigs import recorded
from sizes import size

from robocal.files.robot import open_robot
from robocal.fit.options import Options
from robocal.measure.base import synthesise
from robocal.measure.data import DataSet
from robocal.prove.fit_findings import GROWTH
from robocal.prove.identify import identify

COUNT = 80
STEEL = 12e-6  # 1/K


def told(model, data):
    found = identify(model, data, Options(leave_one_out=False))
    return found, [r for r in found.warnings if r.code == GROWTH]


def arm(kelvin, seed, name="ur10", path=False):
    """An arm that warms up by so much while it is measured, its data, and what it is off by at the end beside the middle (rms)."""
    rng = np.random.default_rng(seed)
    nominal = open_robot(name).chain
    nominal = replace(nominal, table=nominal.table.with_free([n for n in nominal.usual if not n.startswith("tool.")]))
    spread = {"m": 3e-4, "rad": 1e-3}
    off = {n: nominal.table[n].value + rng.normal(0, spread[nominal.table[n].unit]) for n in nominal.geometric}
    true = nominal.with_values(off)
    hot = true.with_values({n: true.table[n].value * (1 + STEEL * kelvin) for n in true.lengths})
    rig = recorded("position", true, rng, COUNT, COUNT)
    k = len(nominal.joints)
    q = rng.uniform(-1.2, 1.2, (COUNT, k))
    if path:
        turn = 2 * np.pi * rng.uniform(2, 6, k) * np.arange(COUNT)[:, None] / COUNT
        q = np.sin(turn + rng.uniform(0, 6, k))
    asked = DataSet(replace(rig.configurations, joints=q), rig.observations)
    read, cold, warm = synthesise(true, asked, rng), synthesise(true, asked), synthesise(hot, asked)
    (obs,), change = read.observations, warm.observations[0].value - cold.observations[0].value
    share = (obs.configuration / (COUNT - 1))[:, None]
    grown = replace(obs, value=obs.value + share * change)
    return nominal, DataSet(read.configurations, (grown,)), float(np.sqrt((change**2).sum(axis=1).mean()))


@pytest.mark.parametrize("seed", [0, 1])
def test_an_arm_that_warms_up_is_told_by_how_much(seed):
    model, data, change = arm(20, seed)
    found, (said,) = told(model, data)
    assert found.verdict.status == "improved"
    numbers = said.numbers
    assert numbers["size"].value == pytest.approx(change, rel=0.35)
    assert numbers["after"].value > 1.2 * numbers["left"].value


@pytest.mark.parametrize("path", [False, True])
def test_an_arm_that_stays_as_it_is_gets_no_remark(path):
    assert not told(*arm(0, 3, path=path)[:2])[1]


def test_lengths_that_grow_are_told_of_a_cable_robot_too():
    log = Log(seed=2, path=False)
    assert not told(log.nominal(), log.data())[1]
    log.y *= 1 + 1e-3 * np.arange(log.count)[:, None] / log.count
    found, (said,) = told(log.nominal(), log.data())
    assert said.numbers["group"] == "lengths"


def test_what_moved_at_a_row_did_not_grow():
    log = Log(seed=2, path=False)
    log.shift_instrument(45, 0.012)
    found, said = told(log.nominal(), log.data())
    assert found.verdict.status == "refused" and not said


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ur10", "rv-2aj"])
def test_most_that_warm_up_are_told_and_hardly_any_other(name):
    count = size(40, 10)
    caught = sum(bool(told(*arm(20, seed, name)[:2])[1]) for seed in range(count))
    slandered = sum(bool(told(*arm(0, seed, name, path=seed % 2 == 0)[:2])[1]) for seed in range(count))
    assert caught >= 0.9 * count and slandered <= 0.03 * count
