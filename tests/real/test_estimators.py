"""The filter on real data: one pass over the UR10 and the FR3, and passes that settle, against least squares."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from real.test_franka import load
from sizes import size

from robocal.files.dataset import read_dataset
from robocal.files.robot import open_robot
from robocal.fit.options import Options
from robocal.prove.identify import identify

__all__ = ["load"]
EXAMPLE = Path(__file__).parents[2] / "examples" / "ur10-tracker"


@pytest.fixture
def ur10(shared_data, tmp_path):
    for name in ("robot.yaml", "data.yaml"):
        shutil.copyfile(EXAMPLE / name, tmp_path / name)
    shutil.copyfile(
        shared_data / "ur10-laser-tracker" / "Series_C" / "measurements_random_poses.csv",
        tmp_path / "measurements_random_poses.csv",
    )
    robot = open_robot(str(tmp_path / "robot.yaml")).chain
    data = read_dataset(tmp_path / "data.yaml", robot).dataset
    return robot, data.take(np.arange(0, len(data.configurations), size(1, 3)))


def compare(name, robot, data, once_is_enough=True):
    lm, once, settled = (
        identify(robot, data, Options(leave_one_out=False, **more))
        for more in ({}, {"method": "ekf", "max_iterations": 1}, {"method": "ekf"})
    )
    for words, found in (("one pass", once), ("settled", settled)):
        held = [a.held_out.mean / b.held_out.mean for a, b in zip(found.stages, lm.stages, strict=True)]
        far = max(
            abs(a.delta - b.delta) / b.sigma_conditional
            for a, b in zip(found.parameters, lm.parameters, strict=True)
            if b.sigma_conditional
        )
        print(
            f"{name}, {words}: held-out errors {held}, chi2 {found.chi2 / lm.chi2:.6f} of lm's, within {far:.4f} sigma"
        )
        if once_is_enough or found is settled:
            assert all(abs(h - 1) < 0.02 for h in held) and abs(found.chi2 / lm.chi2 - 1) < 0.02
    assert far < 0.01 and settled.reason.converged


@pytest.mark.slow
def test_ur10(ur10):
    compare("UR10", *ur10)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["position", "pose"])
def test_fr3(load, kind):
    """Positions seen from the hand leave so much open at first that one pass is led astray; passes that settle are not."""
    compare(f"FR3 {kind}", *load(kind), once_is_enough=kind == "pose")
