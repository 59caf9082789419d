"""The files of the manual are read as they are printed there."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.files.dataset import read_dataset
from robocal.files.robot import read_robot

ROBOT = """\
robocal: 1                      # schema
name: Mitsubishi RV-2AJ
kind: arm                       # arm | cable
units: {length: mm, angle: deg}
convention: khalil-hayati       # dh, mdh: keys theta d a alpha; khalil: keys alpha d theta r (d along x, r along z);
                                # each with -hayati for beta; also elements | s-model | cpc | mcpc | zero-reference | poe | poe-local | urdf
joints:
  - {name: j1, type: revolute, alpha: 0, d: 0, theta: 0, r: 300, limits: [-150, 150]}
  - {name: j2, alpha: -90, theta: -90}
base: {free: false}             # the robot's own base and tool; xyz and rotation vector (or rpy under that name)
tool: {xyz: [0, 0, 72], free: true}
calibrate: {free: [beta, alpha, d, theta, r], fixed: [j2.beta], prior: {length: 1.0, angle: 0.1}}   # groups or single names
source: where each number comes from
"""
DATA = """\
robocal: 1                      # data.yaml beside any CSV, however it is written; several files may be given to one identification
kind: position                  # position | pose | distance | lengths | pixels | ...
file: tracker.csv
csv: {separator: ";", decimal: ",", header: true}        # columns by name, or by zero-based index without a header
joints: {columns: [q1, q2], unit: deg}
position: {columns: [x, y, z], unit: mm, sigma: 0.02}    # a number, {columns: [sx, sy, sz]}, or absent (then estimated)
# orientation: {columns, form: matrix | quaternion_xyzw | quaternion_wxyz | rotation_vector | euler, order: XYZ, frame: intrinsic, unit}
frame: {name: tracker, free: true}                       # an instrument's frame belongs to its data file; default free
targets: {smr1: {xyz: [0, 0, 0.1], free: true}}          # where the measured points sit on the tool; default the tool frame
configuration: {id: pose, temperature: {column: T, unit: degC}, payload: {column: kg, unit: kg}, approach: dir}   # optional columns
"""
TABLE = "pose;q1;q2;x;y;z;T;kg;dir\nA;10,5;20;300;0;1,5;21,5;2;1\nB;-10;2E+1;300;0;1;21,5;2;-1\n"


def test_as_printed(tmp_path):
    for name, text in (("robot.yaml", ROBOT), ("data.yaml", DATA), ("tracker.csv", TABLE)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    robot = read_robot(tmp_path / "robot.yaml")
    reading = read_dataset(tmp_path / "data.yaml", robot.chain)
    c, o = reading.dataset.configurations, reading.dataset.observations[0]
    assert c.ids == ("A", "B") and o.frame.name == "tracker" and o.targets[0].name == "smr1"
    np.testing.assert_allclose(c.joints, np.radians([[10.5, 20], [-10, 20]]))
    np.testing.assert_allclose(o.value, [[0.3, 0, 0.0015], [0.3, 0, 0.001]])
    assert o.sigma == pytest.approx(np.full((2, 3), 2e-5))
    assert c.columns["payload"].tolist() == [2, 2] and c.columns["approach"].tolist() == [1, -1]
    assert c.columns["temperature"] == pytest.approx([294.65, 294.65])
