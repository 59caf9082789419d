"""From SI to what a document shows: every number in the unit that stands beside it."""

from __future__ import annotations

import math
from dataclasses import fields, is_dataclass
from typing import get_args, get_type_hints

import numpy as np
import pytest

from robocal.files.display import to_display
from robocal.files.evidence_parts import GroupTried, JointOffset
from robocal.files.result import AngleResiduals, ResidualSummary, Result
from robocal.files.units import UNITS, Units
from robocal.prove.offsets import JointOffset as Found
from robocal.prove.statistics import Fold, Stages, Statistic
from robocal.quantities import AMOUNT, DISPLAY, MEAN, OWN, VALUE
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark


def stages(unit: str) -> Stages:
    some = Statistic.of(np.array([1e-3, 3e-3]))
    folds = (Fold("1", 2, 2e-3, math.inf),)
    return Stages(unit=unit, before=some, folds=folds, all_rows=Stages(unit=unit, after=some))


@pytest.mark.parametrize(("unit", "name", "size"), [("m", "mm", 1e3), ("rad", "deg", 180 / math.pi), ("px", "px", 1.0)])
def test_a_tree_is_in_the_unit_that_it_names(unit, name, size):
    made = to_display(ResidualSummary, stages(unit), angle=None)
    assert made.unit == name and made.before.n == 2 and made.after is None
    assert (made.before.mean, made.before.max) == pytest.approx((2e-3 * size, 3e-3 * size), rel=1e-15)
    assert made.folds[0].before == pytest.approx(2e-3 * size) and made.folds[0].after == math.inf
    assert isinstance(made.all_rows, AngleResiduals) and made.all_rows.unit == name
    assert made.all_rows.after.p95 == pytest.approx(2.9e-3 * size)


def test_parts_may_speak_in_the_units_of_the_robots_file():
    found = Found("j1", "rad", 1e-3, math.nan, (0.0, 2e-3), "identified", (Remark.of(Code.LITTLE_SAID),))
    made = to_display(JointOffset, found, Units(angle=UNITS["mrad"]))
    assert (made.unit, made.offset, made.sigma, made.interval) == ("mrad", pytest.approx(1.0), None, (0.0, 2.0))
    assert made.remarks[0].code == Code.LITTLE_SAID and made.note == made.remarks[0].sentence


def test_a_tuple_of_numbers_is_the_part_whose_fields_they_are():
    class Tried:
        name, parameters, entered, unit, gain, before = "ripple", 4, True, "m", (1e-3, -1e-3, math.inf), None

    made = to_display(GroupTried, Tried(), reason="why", code="code", orders={})
    assert (made.gain.mean, made.gain.low, made.gain.high) == (1.0, -1.0, None)


def test_nothing_is_left_to_a_default():
    with pytest.raises(AttributeError, match="angle"):
        to_display(ResidualSummary, stages("m"))


def test_every_number_with_a_unit_stands_below_one():
    seen: dict[str, bool] = {}

    def walk(kind: type, there: bool) -> None:
        hints = get_type_hints(kind, include_extras=True)
        marks = {f.name: _marks(hints[f.name]) for f in fields(kind)}
        there |= any(m & {DISPLAY, OWN} for m in marks.values())
        for name, found in marks.items():
            key = f"{kind.__name__}.{name}"
            if found & {AMOUNT, VALUE, MEAN}:
                assert there, f"{key} has no unit beside it"
            if seen.get(f"{key} {there}"):
                continue
            seen[f"{key} {there}"] = True
            for part in _parts(hints[name]):
                walk(part, there)

    walk(Result, False)
    assert len(seen) > 150


def _marks(hint):
    return {a for a in _inside(hint) if a in (AMOUNT, VALUE, MEAN, DISPLAY, OWN)}


def _parts(hint):
    return [a for a in _inside(hint) if isinstance(a, type) and is_dataclass(a)]


def _inside(hint):
    return [hint, *(i for a in get_args(hint) for i in _inside(a))]
