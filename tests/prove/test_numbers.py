"""Numbers of instruments that were stated wrong: named with what the data say instead, and no gain counts; silent otherwise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measure.rigs import BALL, XYZ, anywhere, configurations, recorded, recorded_by, rows

from robocal.files.robot import open_robot
from robocal.fit.options import Options
from robocal.measure.data import DataSet, Frame
from robocal.prove.identify import identify
from robocal.remarks.code import Code

NUMBERS = (Code.NUMBER_WRONG, Code.NUMBER_DOUBTED)


def wires(truth, rng, m, contact=0):
    """Three draw-wires from places beside the robot to the ball."""
    around = [(1.0, 0.2, 0.1), (-0.3, 1.2, 0.1), (-0.6, -0.9, 0.2)]
    found = []
    for i, p in enumerate(around):
        ends = (Frame(f"post{i}", (*p, 0.0, 0.0, 0.0), XYZ), BALL)
        index = np.arange(m)[i::3]
        found.append(
            rows("distance", len(index), 2e-5, None, (), configuration=index, group=f"wire{i}", options={"ends": ends})
        )
    return DataSet(configurations(anywhere(truth, rng, m)), tuple(found))


def held(data, **values):
    """The same readings, where these numbers are stated and held instead of identified."""

    def one(obs):
        known = obs.options.get("values", {}) | {k: v for k, v in values.items() if k in obs.options.get("values", {})}
        return replace(obs, options={**obs.options, "values": known, "free": ()}) if known else obs

    return DataSet(data.configurations, tuple(map(one, data.observations)))


def run(kind, change, seed=0, **values):
    """A run on an arm with errors of 0.3 mm and 1 mrad, whose readings were changed, or whose instrument's numbers were."""
    rng = np.random.default_rng(seed)
    nominal = open_robot("ur10").chain
    nominal = replace(nominal, table=nominal.table.with_free([n for n in nominal.usual if not n.startswith("tool.")]))
    scale = {"m": 3e-4, "rad": 1e-3}
    off = {n: nominal.table[n].value + rng.normal(0, scale[nominal.table[n].unit]) for n in nominal.geometric}
    truth = nominal.with_values(off)
    made = recorded_by(kind, truth, rng, 90, 90) if callable(kind) else recorded(kind, truth, rng, 90, 90)
    data = held(made, **values)
    data = replace(data, observations=tuple(change(o) for o in data.observations))
    found = identify(nominal, data, Options(leave_one_out=False))
    told = [r for r in (*found.verdict.reasons, *found.warnings) if r.code in NUMBERS]
    return found, told


def same(obs):
    return obs


def longer(by):
    return lambda obs: replace(obs, value=obs.value + by * np.eye(obs.value.shape[1])[0])


@pytest.mark.sampled(2)
@pytest.mark.parametrize("kind", ["range", wires, "spherical", "sphere", "plane", "pixels"])
def test_right_numbers_are_not_questioned(kind):
    true = {"range": {"speed": 345.5, "delay": 2e-3}}.get(kind, {})
    found, told = run(kind, same, **true)
    assert found.verdict.status == "improved" and not told


@pytest.mark.sampled(1)
@pytest.mark.parametrize(
    ("kind", "change", "values", "name", "there", "line"),
    [
        ("range", longer(5e-3), {"speed": 345.5, "delay": 2e-3}, "air.delay", 7e-3, "medium: {free: [delay]}"),
        ("distance, between configurations", same, {"length": 0.205}, "bar.length", 0.2, "length: {free: true}"),
        ("spherical", longer(3e-3), {"zero": 1e-3}, "prism.zero", -2e-3, "zero: {free: true}"),
        ("pixels", same, {}, "lens.cx", 1000.0, "camera: {free: [cx]}"),
    ],
)
def test_a_wrong_number_is_named(kind, change, values, name, there, line):
    if kind == "pixels":

        def change(obs):
            camera = list(obs.options["intrinsics"])
            camera[2] += 40.0
            return replace(obs, options={**obs.options, "intrinsics": tuple(camera)})

    found, told = run(kind, change, **values)
    assert len(told) == 1, found.verdict.reasons
    numbers = told[0].numbers
    assert numbers["name"] == name and numbers["line"] == line
    assert numbers["there"].value == pytest.approx(there, abs=0.3 * abs(numbers["stated"].value - there))
    assert told[0].code is Code.NUMBER_WRONG and found.verdict.status == "refused"
    assert told[0] == found.verdict.reasons[0]


def test_instruments_that_share_what_is_wrong_are_named_together():
    found, told = run(wires, longer(2e-3))
    (only,) = told
    assert only.numbers["name"] == "wire0.length, wire1.length, wire2.length" and found.verdict.status == "refused"
    assert only.numbers["there"].value == pytest.approx(-2e-3, abs=2e-4)


def test_one_of_several_instruments_is_named_alone():
    _, told = run(wires, lambda o: longer(2e-3)(o) if o.group == "wire1" else o)
    assert [t.numbers["name"] for t in told] == ["wire1.length"]


@pytest.mark.parametrize("kind", ["sphere", "point"])
def test_what_gives_the_scale_is_not_questioned_here(kind):
    """The radius of a ball, a distance between two things that stand still: were they free, everything could shrink to a
    point. What is wrong there, the scale tells."""

    def far(obs):
        return longer(5e-3)(obs) if obs.kind == "distance" else obs

    found, told = run(kind, far, **({"radius": 0.031} if kind == "sphere" else {}))
    assert not told
    assert found.verdict.status == "refused" and found.verdict.reasons[0].code is Code.SCALE_WRONG
