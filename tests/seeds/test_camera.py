"""Chapter 5 of the thesis: ten real camera measurements. Small linear residuals hide large real ones, and nothing is
gained."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from unseen import leave_one_out

from robocal.estimate.least_squares import least_squares
from robocal.files.dataset import read_dataset
from robocal.files.robot import read_robot
from robocal.fit.misfit import errors
from robocal.measure.base import problem
from robocal.prove.identify import identify

FOLDER = Path(__file__).parents[2] / "examples" / "arm-with-camera"
CM = 0.01


@pytest.fixture(scope="module")
def example():
    robot = read_robot(FOLDER / "robot.yaml").chain
    return robot, read_dataset(FOLDER / "data.yaml", robot).dataset


def test_transcribed_as_printed(example, shared_data):
    from ruamel.yaml import YAML

    tables = {}
    for part in YAML(typ="safe").load_all((shared_data / "seeds" / "arm-lse-ekf.yaml").read_text()):
        tables |= part
    robot, data = example
    angles = np.array(tables["configs_deg"]["ch5_printed"]) - np.array(tables["configs_deg"]["ch5_zero_table5_2"])
    np.testing.assert_allclose(np.rad2deg(data.configurations.joints), angles[:, 1:7], atol=1e-9)
    value = CM * np.array(tables["Yprime"]["ch5_measured"]).reshape(10, 3)
    np.testing.assert_allclose(data.observations[0].value, value, atol=1e-12)
    assert len(robot.table.free) == 27


@pytest.mark.parametrize(("theta3", "linear", "real"), [(7.0, 2.41, 48.3), (-7.0, 2.52, 51.4)])
def test_one_linear_step_promises_what_it_does_not_keep(example, theta3, linear, real):
    """Residuals in cm, rms per axis, of the minimum-norm step in cm and rad."""
    robot, data = example
    q = data.configurations.joints.copy()
    q[0, 2] = np.deg2rad(theta3)
    obs = replace(data.observations[0], frame=None, sigma=np.full((10, 3), CM))
    made = problem(robot, replace(data, configurations=replace(data.configurations, joints=q), observations=(obs,)))
    lin = made.linearize(made.start)
    units = np.array([CM if robot.table[n].unit == "m" else 1.0 for n in made.free])
    assert np.linalg.matrix_rank(lin.j * units) == 18
    step = -units * (np.linalg.pinv(lin.j * units, rcond=1e-12) @ lin.r)
    after = made.residuals(made.retract(made.start, step[None]))[0].value / CM
    assert np.sqrt(np.mean((lin.r + lin.j @ step) ** 2)) == pytest.approx(linear, abs=0.01)
    assert np.sqrt(np.mean(after**2)) == pytest.approx(real, abs=0.1)


def test_a_fit_that_is_free_to_bend_predicts_nothing(example):
    """Priors of 30 cm and 1 rad: a good fit of ten poses, lengths that are a metre off, and unseen poses missed
    threefold."""
    robot, data = example
    table = robot.table.with_priors({n: 0.3 if robot.table[n].unit == "m" else 1.0 for n in robot.table.free})
    obs = replace(data.observations[0], frame=None)
    made = problem(replace(robot, table=table), replace(data, observations=(obs,)))
    solution = least_squares(made, max_iterations=1000)
    fitted = errors(made.residuals(solution.x), "m")[0].mean() / CM
    unseen = leave_one_out(made, solution.x, np.arange(10)).mean() / CM
    moved = max(abs(solution.x[0, made.table.index[n]] - table[n].value) for n in table.free if table[n].unit == "m")
    print(f"fitted {fitted:.1f} cm, unseen {unseen:.1f} cm, a length moved by {moved / CM:.0f} cm")
    assert 2.0 < fitted < 3.0
    assert unseen > 2 * fitted
    assert moved > 50 * CM


def test_refused(example):
    robot, data = example
    found = identify(robot, data)
    assert found.verdict.status == "refused", found.verdict
    left = found.stages[0]
    mean = left.constant.mean
    assert mean == pytest.approx(0.1197, abs=1e-4)
    # 27 parameters do no better on unseen poses than frames alone, and both are centimetres off.
    assert 0.9 < left.leave_one_out.mean / left.leave_one_out_before.mean < 1.05
    assert 0.7 < left.leave_one_out.mean / mean < 1.0
    assert not any(p.status == "identified" and p.name in robot.table for p in found.parameters)
