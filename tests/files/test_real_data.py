"""Real tables are read through a data file alone, however they are written."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.arms.conventions import chain
from robocal.errors import FormatError
from robocal.files.dataset import read_dataset
from robocal.files.robot import parse_robot
from robocal.files.text import Source, read_text
from robocal.geometry import se3, so3

UR10 = """\
robocal: 1
name: UR10
units: {length: mm, angle: deg}
convention: dh-hayati
joints:
  - {name: j1, d: 127.3, alpha: 90}
  - {name: j2, a: -612}
  - {name: j3, a: -572.3}
  - {name: j4, d: 163.941, alpha: 90}
  - {name: j5, d: 115.7, alpha: -90}
  - {name: j6, d: 92.2}
"""
TRACKER = """\
robocal: 1
kind: pose
file: FILE
csv: {separator: ";", decimal: ",", header: true}    # a German spreadsheet wrote it
joints:
  columns: [shoulder_pan_joint, shoulder_lift_joint, elbow_joint, wrist_1_joint, wrist_2_joint, wrist_3_joint]
  unit: rad
position:
  columns: [measurement_x, measurement_y, measurement_z]
  unit: mm
  sigma: {columns: [measurement_std_x, measurement_std_y, measurement_std_z]}
orientation:
  columns: [measurement_rx, measurement_ry, measurement_rz]
  form: euler
  order: XYZ
  frame: intrinsic
  unit: deg
  sigma: {columns: [measurement_std_rx, measurement_std_ry, measurement_std_rz]}
frame: {name: tracker, free: true}
configuration: {temperature: {column: measurement_temperature, unit: degC}}
"""
FRANKA = """\
robocal: 1
kind: pose
file: FILE
joints: {columns: [q1, q2, q3, q4, q5, q6, q7]}
orientation: {columns: board_T_camera, form: matrix}
frame: {name: board}
targets: {camera: {free: true}}
"""


def relative_turns(pose):
    """Angles between the first pose and the others: the same for robot and instrument, wherever the instrument
    stands."""
    return np.linalg.norm(so3.log((se3.inverse(pose[:1]) @ pose)[:, :3, :3]), axis=1)


@pytest.mark.parametrize(
    ("series", "rows"), [("Series_C/measurements_random_poses.csv", 2773), ("Series_D/measurements_iso_cubes.csv", 632)]
)
def test_laser_tracker(shared_data, tmp_path, series, rows):
    arm = parse_robot(Source(tmp_path / "ur10.yaml", UR10, "")).chain
    place = tmp_path / "data.yaml"
    place.write_text(TRACKER.replace("FILE", str(shared_data / "ur10-laser-tracker" / series)))
    reading = read_dataset(place, arm)
    c, o = reading.dataset.configurations, reading.dataset.observations[0]
    assert len(c) == len(o) == rows and o.rows[0] == 2 and reading.warnings == () and reading.suspicions == ()
    assert 290 < c.columns["temperature"].min() < c.columns["temperature"].max() < 300
    measured = se3.from_vector(o.value)
    difference = np.abs(relative_turns(arm.pose(c.joints)) - relative_turns(measured))
    assert np.median(difference) < 2e-3
    # For its positions only, and in a wrong unit.
    assert read_dataset(place, arm, kind="position").dataset.observations[0].value.shape == (rows, 3)
    place.write_text(place.read_text().replace("unit: mm", "unit: m"))
    (doubt,) = read_dataset(place, arm, kind="position").suspicions
    assert (doubt.stated, doubt.alternative) == ("m", "mm")
    place.write_text(place.read_text().replace('decimal: ","', 'decimal: "."'))
    with pytest.raises(FormatError, match="decimal comma that the file does not announce"):
        read_dataset(place, arm)


def test_a_table_with_damaged_line_ends(shared_data):
    text = read_text(shared_data / "ur10-laser-tracker" / "Series_D" / "calibration_handeye.csv").text
    assert "\0" not in text and text.count("\n") == 26


def test_camera_on_the_hand(shared_data, tmp_path):
    rows = [
        {},
        {"alpha": -90},
        {"alpha": 90, "d": 0.316},
        {"a": 0.0825, "alpha": 90},
        {"a": -0.0825, "alpha": -90, "d": 0.384},
    ]
    rows += [{"alpha": 90}, {"a": 0.088, "alpha": 90}]
    arm = chain("fr3", "mdh", [{k: v * np.pi / 180 if k == "alpha" else v for k, v in row.items()} for row in rows])
    place = tmp_path / "data.yaml"
    place.write_text(FRANKA.replace("FILE", str(shared_data / "franka-fr3-board" / "poses.csv")))
    reading = read_dataset(place, arm)
    o = reading.dataset.observations[0]
    assert (
        len(o) == 114 and o.frame.name == "board" and o.targets[0].name == "camera" and o.targets[0].free == (True,) * 6
    )
    difference = relative_turns(arm.pose(reading.dataset.configurations.joints)) - relative_turns(
        se3.from_vector(o.value)
    )
    assert np.abs(difference).max() < 0.03
    with pytest.raises(FormatError, match="several columns could be the measured pose"):
        read_dataset(shared_data / "franka-fr3-board" / "poses.csv", arm)
