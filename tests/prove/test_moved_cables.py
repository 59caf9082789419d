"""An instrument that stood elsewhere from a row on beside a cable robot, and zeros of all cables that were set anew: named with their file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cables.logs import Log
from sizes import size

import robocal as rc
from robocal.fit.options import Options
from robocal.prove.identify import identify

KINDS = ["eight", "planar"]


def found(log, known=True):
    said = identify(log.nominal(), log.data(known), Options(leave_one_out=False))
    return said, [r for r in said.verdict.reasons if r.code.startswith("segment")]


def change(log, what, at, by):
    if what == "instrument":
        log.shift_instrument(at, by)
    else:
        log.y[at:] += by * log.rng.choice([-1, 1], len(log.a)) * log.rng.uniform(0.5, 1.5, len(log.a))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("what", "code", "file"), [("instrument", "segment", "poses.csv"), ("zeros", "segment-of-zeros", "lengths.csv")]
)
def test_what_changed_is_named_with_its_file_and_rows(kind, what, code, file):
    log = Log(kind, seed=8, path=False)
    change(log, what, 37, 0.012)
    said, told = found(log, known=what == "zeros")
    assert said.verdict.status == "refused" and [r.code for r in told] == [code]
    numbers = told[0].numbers
    assert numbers["file"] == file and abs(numbers["first"] - 39) <= 1 and numbers["last"] == 91
    assert numbers["shift"].value == pytest.approx(0.012, rel=0.25)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_of_many_changes_nearly_all_are_named_and_of_none_hardly_any(kind):
    count, caught, slandered = size(40, 10), 0, 0
    for seed in range(count):
        rng = np.random.default_rng(seed)
        wrong, good = (Log(kind, seed=300 + seed, path=seed % 2 == 0) for _ in range(2))
        change(wrong, ("instrument", "zeros")[seed // 2 % 2], int(rng.integers(20, 70)), 0.01)
        caught += bool(found(wrong)[1])
        slandered += bool(found(good)[1])
    assert caught >= 0.95 * count and slandered <= 0.03 * count


def test_lengths_alone_name_no_zeros_of_a_few_rows():
    """Eight lengths leave two numbers beside a pose: eight zeros would meet any five rows."""
    folder = Path(__file__).parents[2] / "examples" / "cable-calibration" / "eight"
    found = rc.identify(folder / "robot.yaml", folder / "lengths.yaml").result
    assert found.verdict.status == "improved"
