"""UR10 and laser tracker (Landgraf et al., 2021): robot and data as in examples/ur10-tracker, the published CSV read
as it is."""

from __future__ import annotations

from pathlib import Path

import pytest
from real.splits import report, splits

from robocal.files.dataset import read_dataset
from robocal.files.robot import read_robot

EXAMPLE = Path(__file__).parents[2] / "examples" / "ur10-tracker"
FILES = {"C": "Series_C/measurements_random_poses.csv", "D": "Series_D/measurements_iso_cubes.csv"}
ORIENTATION = """
orientation:
  columns: [measurement_rx, measurement_ry, measurement_rz]
  form: euler
  order: XYZ
  frame: intrinsic
  unit: deg
  sigma: {columns: [measurement_std_rx, measurement_std_ry, measurement_std_rz]}
"""


@pytest.fixture
def load(shared_data, tmp_path):
    def read(series, kind="position"):
        csv = shared_data / "ur10-laser-tracker" / FILES[series]
        text = (EXAMPLE / "data.yaml").read_text().replace("measurements_random_poses.csv", str(csv))
        if kind == "pose":
            text = text.replace("kind: position", "kind: pose") + ORIENTATION
        (tmp_path / "data.yaml").write_text(text)
        robot = read_robot(EXAMPLE / "robot.yaml").chain
        return robot, read_dataset(tmp_path / "data.yaml", robot).dataset

    return read


def test_the_damaged_german_csv_is_read_whole(load):
    robot, data = load("C")
    assert len(data.configurations) == 2773
    assert data.observations[0].value[0] == pytest.approx([0.38397123, -3.2407562, 0.20172621])
    assert data.observations[0].sigma[0] == pytest.approx([4.1565e-5, 2.2023e-5, 5.5848e-6])
    assert data.configurations.columns["temperature"][0] == pytest.approx(273.15 + 21.68, abs=1e-3)


def test_series_c(load):
    before, after = report("UR10, series C, 150 random poses fitted, 500 held out", splits(*load("C"), 150, 500))
    assert 0.88 < before < 0.97
    assert after <= 0.46


@pytest.mark.slow
def test_series_d(load):
    before, after = report("UR10, series D, 150 poses of ISO cubes fitted, 482 held out", splits(*load("D"), 150, 482))
    assert after < 0.55 * before
    assert after <= 0.40


def test_full_pose(load):
    errors = splits(*load("C", "pose"), 150, 500, seeds=range(3))
    before, after = report("UR10, series C, full pose", errors)
    assert after <= 0.47 < before
