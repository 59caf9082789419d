"""Lengths of another moment than the poses beside them, of all cables or of one: refused and named; nothing without a lag or a path."""

from __future__ import annotations

import numpy as np
import pytest
from cables.logs import Log
from sizes import size

from robocal.diagnose import limits
from robocal.fit.options import Options
from robocal.prove.identify import identify
from robocal.remarks.code import Code

CODES = (Code.LATE, Code.LATE_DOUBTED)
KINDS = ["eight", "planar"]


def found(log, known=True):
    said = identify(log.nominal(), log.data(known), Options(leave_one_out=False))
    return said, [r for r in (*said.verdict.reasons, *said.warnings) if r.code in CODES]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("rows", [0.7, -0.4])
def test_lengths_that_were_read_late_or_early_are_refused(kind, rows):
    log = Log(kind, seed=3)
    log.delay(rows)
    said, told = found(log)
    assert said.verdict.status == "refused" and [r.code for r in told] == [Code.LATE]
    numbers = told[0].numbers
    assert numbers["group"] == "lengths" and "tracker" in numbers["than"]
    assert numbers["before" if rows > 0 else "after"].value == pytest.approx(abs(rows), rel=0.2)


@pytest.mark.parametrize(("kind", "cable"), [("eight", 5), ("planar", 2)])
def test_one_cable_that_was_read_late_is_named(kind, cable):
    log = Log(kind, seed=4)
    log.delay(0.5, cable)
    said, told = found(log)
    assert said.verdict.status == "refused" and told[0].code == Code.LATE
    assert told[0].numbers["group"] == f"cable c{cable + 1} of lengths"


def test_a_cable_that_explains_all_beyond_the_noise_is_refused_though_its_share_is_small():
    log = Log("eight", seed=907, count=80)
    log.delay(0.02, 3)
    said, told = found(log)
    assert said.verdict.status == "refused" and [r.code for r in told] == [Code.LATE]
    assert limits.LATE_WHOLE_SHARE < told[0].numbers["share"] < limits.NUMBER_SHARE


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("path", [True, False])
def test_without_a_lag_nothing_is_said(kind, path):
    said, told = found(Log(kind, seed=5, path=path), known=False)
    assert said.verdict.status == "improved" and not told


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_of_many_lags_nearly_all_are_refused_and_of_none_hardly_any(kind):
    count, caught, slandered = size(40, 10), 0, 0
    for seed in range(count):
        rng = np.random.default_rng(seed)
        late, good = Log(kind, seed=100 + seed), Log(kind, seed=100 + seed, path=seed % 2 == 0)
        late.delay(rng.uniform(0.3, 1.0) * rng.choice([-1, 1]))
        caught += found(late)[0].verdict.status == "refused"
        slandered += bool(found(good)[1])
    assert caught >= 0.95 * count and slandered <= 0.03 * count
