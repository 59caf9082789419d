"""What each group of sensors pays for blocks and shared columns is the same by sums as row by row."""

from __future__ import annotations

import numpy as np
import pytest
from measure.scenarios import SCENARIOS, build

from robocal.estimate.leverage import _row_by_row, leverages

# With local blocks of one family; others are asked row by row.
BLOCKS = [name for name in SCENARIOS if "free poses" in name or name == "mixed"]


@pytest.mark.parametrize("loss", ["none", "huber"])
@pytest.mark.parametrize("name", BLOCKS)
def test_sums_are_those_of_rows(name, loss):
    p = build(name)
    if p.sizes[1][1]:
        pytest.skip("two families")
    p = p.with_loss(loss).soften(p.start, 1.0)
    every = np.arange(p.configurations)
    one, other = leverages(p, p.start, every), _row_by_row(p, p.start, every)
    assert one.keys() == other.keys()
    for key, (own, shared, many) in one.items():
        # Squares have half the digits.
        assert other[key] == pytest.approx((own, shared, many), rel=1e-4, abs=1e-6), key


@pytest.mark.parametrize("name", BLOCKS[:2])
def test_a_configuration_that_is_not_asked_takes_nothing(name):
    p = build(name)
    p = p.soften(p.start, 1.0)
    some, every = np.arange(p.configurations - 1), np.arange(p.configurations)
    less, more = leverages(p, p.start, some), leverages(p, p.start, every)
    # A free pose is told by a difference of sums that its soft columns make large: a billionth of a degree of freedom is left.
    for key, sums in _row_by_row(p, p.start, some).items():
        assert less[key] == pytest.approx(sums, rel=1e-6, abs=1e-8), key
    assert sum(v[2] for v in less.values()) < sum(v[2] for v in more.values())
