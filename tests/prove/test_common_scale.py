"""The scale of an instrument that reads lengths itself: a wrong one is refused, one wrong length is not told as a change of all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measure.rigs import recorded
from trials import TRACKER, joints, observations
from worlds import left_after_registration

from robocal.files.robot import open_robot
from robocal.fit.options import Options
from robocal.measure.base import synthesise
from robocal.measure.data import DataSet
from robocal.prove.identify import identify
from robocal.remarks.code import Code

SCALE = {Code.SCALE_WRONG, Code.SCALED, Code.SCALE_DOUBTED}


def true_arm(name, moved=None, seed=0):
    """An arm with errors of 0.3 mm and 1 mrad and some changed lengths, nominal and true, and what draws the rest."""
    model, rng = open_robot(name).chain, np.random.default_rng(seed)
    off = {n: rng.normal(0, 3e-4 if model.table[n].unit == "m" else 1e-3) for n in model.geometric}
    return (
        model,
        model.with_values({n: model.table[n].value + v + (moved or {}).get(n, 0.0) for n, v in off.items()}),
        rng,
    )


def run(name, scale=1.0, moved=None, seed=0):
    """Positions of it by a tracker of so much scale."""
    model, truth, rng = true_arm(name, moved, seed)
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


@pytest.mark.parametrize(("name", "scale"), [("ur10", 1.004), ("ur10", 0.996), ("panda", 1.005), ("irb-120", 1.0065)])
def test_a_doubted_scale_decides_where_the_correction_holds(name, scale):
    """Between two and five sigma it is a remark: then the band holds the truth, and nobody hears that the arm is better."""
    found, codes = run(name, scale)
    assert codes & SCALE == {Code.SCALED}
    model, truth, _ = true_arm(name)
    q = np.random.default_rng(9).uniform(-1.2, 1.2, (300, len(model.joints)))
    right, fitted, before = (m.pose(q)[:, :3, 3] for m in (truth, found.corrected, model))
    off, nominal = (float(np.sqrt(np.mean(left_after_registration(right, p) ** 2))) for p in (fitted, before))
    assert 0.6 * off < found.holds.band < 2 * off
    assert nominal < off and found.verdict.region == "measured"


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
