"""Anchors and zeros of cables that change as no making leaves them are refused; not where nobody said where they are."""

from __future__ import annotations

from dataclasses import replace

import pytest
from cables.logs import Log

from robocal.fit.options import Options
from robocal.prove.identify import identify
from robocal.remarks.code import Code


def found(robot, log):
    said = identify(robot, log.data(), Options(leave_one_out=False))
    return said, [r.code for r in said.verdict.reasons]


def off(log, name, by, prior=None):
    robot = log.nominal()
    row = robot.table[name]
    return robot.with_table(robot.table.with_values({name: row.value + by}).with_priors({name: prior} if prior else {}))


@pytest.mark.parametrize("name", ["c3.ax", "c2.l0"])
def test_a_number_that_is_off_by_more_than_any_making_leaves_is_refused(name):
    log = Log(seed=6)
    said, codes = found(off(log, name, 0.8), log)
    assert said.verdict.status == "refused" and Code.UNMADE in codes


def test_what_a_tape_measure_leaves_is_not():
    log = Log(seed=6)
    said, codes = found(off(log, "c3.ax", 0.2), log)
    assert said.verdict.status == "improved" and Code.UNMADE not in codes


@pytest.mark.parametrize("prior", [0.5, 5.0])
def test_nor_what_was_stated_to_be_unknown(prior):
    log = Log(seed=6)
    said, codes = found(off(log, "c3.ax", 0.8, prior), log)
    assert said.verdict.status == "improved" and Code.UNMADE not in codes


def test_nor_what_was_assumed_and_zeros_that_nobody_said():
    log = Log(seed=6)
    robot = replace(off(log, "c2.l0", 0.8), assumed=("c2.zero",))
    assert Code.UNMADE not in found(robot, log)[1]
    log = Log(seed=6)
    log.y -= 0.9
    robot = log.nominal()
    robot = robot.with_values({f"c{i + 1}.l0": 0.0 for i in range(8)})
    said, codes = found(robot, log)
    assert said.verdict.status == "improved" and Code.UNMADE not in codes
