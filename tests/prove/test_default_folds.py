"""Folds are the default where a held-out fifth is likely to lose a gain; a robot without lengths has no wrong unit of length."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from trials import TRACKER, joints, observations

from robocal.arms.conventions import chain
from robocal.diagnose.hypotheses.changes import Change, What
from robocal.diagnose.hypotheses.explain import explain
from robocal.files.robot import open_robot
from robocal.fit.options import Options
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.prove.identify import identify


def measured(name, off, seed=0, m=60, sigma=2e-4):
    """Positions of an arm whose zeros are off by so much, with 0.2 mm of noise."""
    model, rng = open_robot(name).chain, np.random.default_rng(seed)
    zeros = [n for n in model.geometric if n.endswith((".theta",))]
    truth = model.with_values({n: model.table[n].value + rng.normal(0, off) for n in zeros})
    stated = replace(observations("position", m), sigma=np.full((m, 3), sigma))
    return model, synthesise(truth, DataSet(joints(model, rng, m), (stated,)), rng)


@pytest.mark.parametrize("name", ["ur10", "panda"])
def test_a_clear_gain_is_proven_by_a_hold_out(name):
    found = identify(*measured(name, 5e-3))
    assert found.how == "held out" and found.verdict.status == "improved"


@pytest.mark.parametrize("name", ["ur10", "irb-120"])
def test_a_faint_one_by_folds(name):
    found = identify(*measured(name, 2e-4))
    assert found.how == "5 folds" and found.options.folds == 5


def test_what_was_asked_for_stands():
    model, data = measured("ur10", 2e-4)
    assert identify(model, data, Options(hold_out=0.3)).how == "held out"
    assert identify(model, data, Options(folds=3)).how == "3 folds"


@pytest.mark.slow
def test_a_perfect_arm_gains_nothing_by_them():
    gains = sum(
        identify(*measured(n, 0.0, seed=i)).verdict.status == "improved" for i in range(15) for n in ("ur10", "irb-120")
    )
    assert gains <= 3  # of 30, 2.5 % each


def turned(rng, m, far, skew):
    """A robot of two axes that meet, with a target far from both, whose axes are off by so much (rad)."""
    rows = [{}, {"alpha": math.pi / 2}]
    robot = chain("positioner", "mdh", rows)
    truth = chain("positioner", "mdh", [{}, {"alpha": math.pi / 2 + skew, "a": skew * far}])
    target = Frame(
        "board", tuple(rng.normal(0, far / 2, 3)) + (0.0,) * 3, (True,) * 3 + (False,) * 3, "tool", (0.2, 3.0)
    )
    camera = Frame("camera", (0.3, -0.5, 1.1, 0.4, 0.3, -0.2), (True,) * 6, expected=(10.0, 3.0))
    where = Configurations(tuple(map(str, range(m))), rng.uniform(-1.2, 1.2, (m, 2)))
    zero = np.zeros(m, dtype=np.int64)
    obs = Observations("position", np.arange(m), np.zeros((m, 3)), np.full((m, 3), 2e-4), camera, (target,), zero)
    data = synthesise(truth, DataSet(where, (obs,)), rng)
    lost = replace(
        data.observations[0], frame=replace(camera, value=(0.0,) * 6), targets=(replace(target, value=(0.0,) * 6),)
    )
    return robot, replace(data, observations=(lost,))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("factor", [1e-3, 1e-2, 0.0254])
def test_a_smaller_unit_explains_nothing_of_a_robot_without_lengths(seed, factor):
    rng = np.random.default_rng(seed)
    robot, data = turned(rng, 60, 1.2, 1e-3)
    change = Change(What.LENGTH_UNIT, (0, 1, 2), factors=(factor,) * 3)
    assert explain(robot, data, [change]) is None


@pytest.mark.parametrize("factor", [1e-3, 1e3, 0.0254])
def test_a_wrong_unit_of_an_arm_is_still_found(factor):
    model, data = measured("ur10", 1e-3)
    wrong = tuple(
        replace(o, value=o.value / factor, frame=replace(TRACKER, value=(0.0,) * 6)) for o in data.observations
    )
    change = Change(What.LENGTH_UNIT, (0, 1, 2), factors=(factor,) * 3)
    found = explain(model, DataSet(data.configurations, wrong), [change])
    assert found is not None and found.changes[0] == (change,)
