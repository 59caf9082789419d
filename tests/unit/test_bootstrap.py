"""The bootstrap: it agrees with the linear bars where these are right, and is wider where they are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from unit.arm_data import FREE, TOOL, arm, measured

from robocal.errors import ModelError
from robocal.fit.options import Options
from robocal.prove.bootstrap import bootstrap_remarks
from robocal.prove.identify import identify


def drawn(data, robot, **more):
    return identify(robot, data, Options(hold_out=0.0, leave_one_out=False, bootstrap=400, **more)).resampled


@pytest.fixture(scope="module")
def scene():
    robot = arm()
    return robot, measured(120, seed=4, sigma=1e-4)


def test_gaussian_noise_scatters_as_the_linear_bars_say(scene):
    robot, data = scene
    found = drawn(data, robot)
    assert found.draws == found.asked == 400 and found.places == 120
    # Each ratio has its own scatter: 1 / sqrt(2 x 400) from the draws and about 1 / sqrt(2 x 120) from the poses.
    assert np.median(found.ratio) == pytest.approx(1.0, abs=0.12)
    assert ((found.low < found.high) & (found.ratio > 0.6) & (found.ratio < 1.6)).all()
    assert found.names and set(found.names) <= {*FREE, *TOOL} | {
        f"tracker.{s}" for s in ("x", "y", "z", "rx", "ry", "rz")
    }


def test_errors_that_repeat_with_the_place_are_in_both_bars():
    """Every place is visited four times and errs by the same each time: four rows say no more than one, and the linear bars count
    places as the bootstrap does. Bars that count rows would be too narrow by two."""
    robot = arm()
    once = measured(80, seed=6, sigma=1e-4)
    q = np.repeat(once.configurations.joints, 4, axis=0)
    data = measured(320, seed=6, sigma=1e-4, q=q, noise=0.0)
    own = np.random.default_rng(7).normal(scale=1e-4, size=(80, 3))
    obs = data.observations[0]
    found = drawn(replace(data, observations=(replace(obs, value=obs.value + np.repeat(own, 4, axis=0)),)), robot)
    assert found.places == 80
    assert np.median(found.ratio) == pytest.approx(1.0, rel=0.15)
    assert f"{np.median(found.ratio):.2g} times" in bootstrap_remarks(found)[0].sentence


def test_the_seed_decides(scene):
    robot, data = scene
    one, same, other = (drawn(data, robot, seed=s).low for s in (1, 1, 2))
    assert np.array_equal(one, same) and not np.array_equal(one, other)


def test_what_cannot_be_drawn_is_refused(scene):
    robot, data = scene
    with pytest.raises(ModelError, match="too few draws"):
        identify(robot, data, Options(hold_out=0.0, leave_one_out=False, bootstrap=10))
    with pytest.raises(ModelError, match="minimises the cost"):
        identify(robot, data, Options(hold_out=0.0, leave_one_out=False, bootstrap=200, method="pinv"))
    assert bootstrap_remarks(None) == ()
