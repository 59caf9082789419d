"""The scale of an instrument that reads lengths itself: a wrong one is refused, one wrong length is not told as a change of all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measure.rigs import recorded
from trials import TRACKER, joints, observations

from robocal.files.robot import open_robot
from robocal.fit.options import Options
from robocal.measure.base import synthesise
from robocal.measure.data import DataSet
from robocal.prove.identify import identify
from robocal.remarks.code import Code

SCALE = {Code.SCALE_WRONG, Code.SCALED, Code.SCALE_DOUBTED}


def run(name, scale=1.0, moved=None, seed=0):
    """Positions by a tracker of so much scale, of an arm with errors of 0.3 mm and 1 mrad and some changed lengths."""
    model, rng = open_robot(name).chain, np.random.default_rng(seed)
    off = {n: rng.normal(0, 3e-4 if model.table[n].unit == "m" else 1e-3) for n in model.geometric}
    truth = model.with_values({n: model.table[n].value + v + (moved or {}).get(n, 0.0) for n, v in off.items()})
    data = synthesise(truth, DataSet(joints(model, rng, 50), (observations("position", 50),)), rng)
    lost = replace(TRACKER, value=(0.0,) * 6)
    data = replace(data, observations=tuple(replace(o, value=scale * o.value, frame=lost) for o in data.observations))
    found = identify(model, data, Options(leave_one_out=False))
    return found, {r.code for r in (*found.verdict.reasons, *found.warnings)}


@pytest.mark.parametrize("name", ["ur10", "panda", "irb-120"])
@pytest.mark.parametrize("scale", [1.015, 0.985])
@pytest.mark.sampled(2)
def test_a_tracker_of_wrong_scale_is_refused(name, scale):
    found, codes = run(name, scale)
    assert found.verdict.status == "refused" and Code.SCALE_WRONG in codes
    assert found.scale.factor == pytest.approx(scale - 1, abs=0.005)


@pytest.mark.parametrize("name", ["ur10", "panda", "irb-120"])
def test_a_right_one_is_not_spoken_of(name):
    found, codes = run(name)
    assert found.verdict.status == "improved" and not codes & SCALE


@pytest.mark.parametrize(("name", "length"), [("ur10", "j2.a"), ("ur10", "j3.a"), ("irb-120", "j2.a")])
@pytest.mark.parametrize("off", [8e-3, -30e-3])
def test_one_wrong_length_is_not_a_change_of_all(name, length, off):
    _, codes = run(name, moved={length: off})
    assert not codes & SCALE


@pytest.mark.parametrize("medium", [True, False])
def test_ranges_through_a_medium_take_their_scale_from_its_speed(medium):
    """A time is as long as its speed says; a range that nothing was multiplied by is a length."""
    model, rng = open_robot("ur10").chain, np.random.default_rng(0)
    model = replace(model, table=model.table.with_free([n for n in model.usual if not n.startswith("tool.")]))
    data = recorded("range", model, rng, 60, 60)
    name = {"medium": "air"} if medium else {"medium": "", "values": {}}
    held = tuple(replace(o, options={**o.options, **name, "free": ()}) for o in data.observations)
    found = identify(model, DataSet(data.configurations, held), Options(leave_one_out=False))
    assert found.scale.stated is medium
