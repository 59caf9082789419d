"""Errors that follow those just before are told where something warms up, not where like poses lie beside each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from prove.test_segments import moved, rig
from trials import observations, open_robot, perturbed

from robocal.diagnose.check_registry import Context
from robocal.diagnose.follow import errors_follow
from robocal.fit.baseline import baseline
from robocal.fit.fit import fit
from robocal.fit.options import Options
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet
from robocal.remarks.code import Code


def told(robot, data):
    every = np.arange(len(data.configurations))
    found = fit(robot, data, every, Options(), baseline(robot, data, every)[1])
    return list(errors_follow.run(Context(robot, data, fit=found)))


@pytest.mark.parametrize("name", ["rv-2aj", "ur10"])
def test_warmth_is_told_and_order_alone_is_not(name):
    rng = np.random.default_rng(11)
    spoken, silent = 0, 0
    t = np.arange(150) / 150
    for _ in range(4):
        robot, true, data = rig(name, "position", 150, rng)
        found = told(robot, moved(true, data, t, np.array([0, 0, 4e-4]), "instrument"))
        spoken += [r.code for r in found] == [Code.ERRORS_FOLLOW]
        silent += not told(robot, data)
    print(f"\n{name}: {spoken} of 4 drifts told, {silent} of 4 clean files silent")
    assert spoken == silent == 4


def test_poses_visited_in_order_are_no_drift(rng):
    """A model that lacks something leaves alike errors at like poses; cubes measured one after the other are no drift."""
    robot = open_robot("ur10").chain
    true = perturbed(robot, rng)
    corners = rng.uniform(-1.2, 1.2, (12, 6))
    q = np.repeat(corners, 15, axis=0) + 0.05 * rng.normal(size=(180, 6))
    # Each cube is visited twice, so that like poses at another time are there to compare with.
    q = np.vstack([q[:90], q[:90] + 0.02 * rng.normal(size=(90, 6))])
    data = synthesise(
        true, DataSet(Configurations(tuple(map(str, range(180))), q), (observations("position", 180),)), rng
    )
    obs = data.observations[0]
    bent = 3e-4 * np.sin(2 * q[:, :3] + 1) * np.cos(3 * q[:, 3:])
    lacking = replace(data, observations=(replace(obs, value=obs.value + bent),))
    assert not told(robot, lacking)
