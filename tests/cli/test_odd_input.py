"""Input that once met a fault in robocal itself ends with a message that names file, row and column."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from cli.runs import robocal

from robocal.arms.chain import WIDEST
from robocal.files.csvtable import read_csv

EXAMPLES = Path(__file__).parents[2] / "examples"
POSES = "x [m],y [m],z [m],rx [rad],ry [rad],rz [rad]\n0,0,2,{},0,0\n0.5,0,2,0,0,0\n0,0.4,2,0,0,0\n0,0.4,2.5,0,0.1,0\n"
URDF = """<robot name="r"><link name="base"/><link name="l1"/><link name="l2"/><link name="tip"/>
<joint name="rail" type="prismatic"><parent link="base"/><child link="l1"/><origin xyz="0 0 0"/><axis xyz="1 0 0"/><limit lower="-{0}" upper="{0}"/></joint>
<joint name="a" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="0 0 0.4"/><axis xyz="0 0 1"/><limit lower="-2" upper="2"/></joint>
<joint name="b" type="revolute"><parent link="l2"/><child link="tip"/><origin xyz="0.3 0 0.1"/><axis xyz="0 1 0"/><limit lower="-2" upper="2"/></joint>
</robot>"""


@pytest.mark.parametrize("cell", ["1e160", "-1e155", "1e300"])
def test_numbers_that_are_no_measurement(tmp_path, cell):
    (tmp_path / "poses.csv").write_text(POSES.format(cell))
    robot = EXAMPLES / "cable-published" / "cogiro.yaml"
    for words in (["cable", "require", robot], ["cable", "tension", robot], ["verify", tmp_path / "poses.csv"]):
        ran = robocal(*words, tmp_path / "poses.csv")
        assert ran.status == 2 and "row 2, column rx: so large a number is no measurement" in ran.said, ran.said


def test_a_standard_deviation_whose_square_is_zero(tmp_path):
    text = (EXAMPLES / "rv-2aj" / "data.yaml").read_text()
    assert "sigma: 0.02" in text
    text = text.replace("file: ", f"file: {os.path.relpath(EXAMPLES / 'rv-2aj', tmp_path)}/")
    (tmp_path / "data.yaml").write_text(text.replace("sigma: 0.02", "sigma: 1.0e-320"))
    ran = robocal("check", EXAMPLES / "rv-2aj" / "robot.yaml", tmp_path / "data.yaml")
    assert ran.status == 2 and "key position.sigma: so small a standard deviation is none" in ran.said


@pytest.mark.parametrize("limit", ["1e6", "1e16", "1e300"])
def test_a_joint_that_nobody_bounds(tmp_path, limit):
    """Exporters write limits of 1e6 m and more where there are none: a plan stays where such a robot is measured."""
    (tmp_path / "rail.urdf").write_text(URDF.format(limit))
    assert float(limit) > WIDEST
    ran = robocal("plan", tmp_path / "rail.urdf", "--poses", "12", "-o", tmp_path / "plan")
    assert ran.status == 0, ran.said
    (listed,) = tmp_path.glob("plan/poses*.csv")
    table = read_csv(listed)
    assert 0.1 < np.abs(table.numbers(["rail"])).max() <= 0.25  # m, to either side


@pytest.mark.parametrize("closed", [[1], [2], [1, 2]])
def test_closed_streams_are_no_fault(tmp_path, closed):
    """A command without a place to write to still writes its files, and nothing else into them."""
    folder = EXAMPLES / "rv-2aj"
    words = [
        sys.executable,
        "-m",
        "robocal",
        "identify",
        folder / "robot.yaml",
        folder / "data.yaml",
        "-o",
        tmp_path / "run",
    ]
    shut = " ".join(f"{stream}>&-" for stream in closed)
    ran = subprocess.run(["bash", "-c", f'"$@" {shut}', "bash", *words], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert (tmp_path / "run" / "report.html").read_text().startswith("<!DOCTYPE html>")


def test_a_history_with_a_cell_of_a_book(tmp_path):
    folder = EXAMPLES / "rv-2aj"
    robocal("identify", folder / "robot.yaml", folder / "data.yaml", "-o", tmp_path / "run")
    (tmp_path / "again").mkdir()
    for file in (tmp_path / "run").iterdir():
        (tmp_path / "again" / file.name).write_bytes(file.read_bytes())
    ran = robocal("drift", tmp_path / "run", tmp_path / "again", "--history", tmp_path / "history.csv")
    assert ran.status == 3 and (tmp_path / "history.csv").exists()  # the same measurements twice
    lines = (tmp_path / "history.csv").read_text().splitlines()
    lines[2] = "x" * 140_000 + lines[2]
    (tmp_path / "history.csv").write_text("\n".join(lines) + "\n")
    before = (tmp_path / "history.csv").read_bytes()
    ran = robocal("drift", tmp_path / "run", tmp_path / "again", "--history", tmp_path / "history.csv")
    assert ran.status == 2 and "history.csv, row 3: the row cannot be split into cells" in ran.said
    assert (tmp_path / "history.csv").read_bytes() == before


@pytest.mark.parametrize("word", ['xyz="0 0 0.4"', 'xyz="0 0 1"'])
def test_a_robot_of_no_size(tmp_path, word):
    """1e160 m, or an axis of that length: its square is no number."""
    text = URDF.format(1)
    assert word in text
    (tmp_path / "arm.urdf").write_text(text.replace(word, word.replace("0 0", "1e160 0", 1)))
    ran = robocal("check", tmp_path / "arm.urdf")
    assert ran.status == 2 and "arm.urdf, row 3, key joint a" in ran.said and "so large a number" in ran.said, ran.said


@pytest.mark.parametrize(
    ("old", "place"), [("tool: {xyz: [0", "key tool"), ("d: 250", "key j3.d"), ("r: 300", "key j1.r")]
)
def test_a_robot_file_of_no_size(tmp_path, old, place):
    text = (EXAMPLES / "rv-2aj" / "robot.yaml").read_text()
    assert old in text
    (tmp_path / "robot.yaml").write_text(text.replace(old, re.sub(r"\d+$", "1.0e+40", old), 1))
    ran = robocal("check", tmp_path / "robot.yaml")
    assert ran.status == 2 and place in ran.said and "so large a number" in ran.said, ran.said


def test_a_study_of_a_robot_with_a_long_name(tmp_path):
    text = (EXAMPLES / "studies" / "coverage-of-an-arm.yaml").read_text()
    (tmp_path / "study.yaml").write_text(re.sub("robot: .*", f"robot: {'x' * 5000}.yaml", text))
    ran = robocal("study", tmp_path / "study.yaml", "-o", tmp_path / "out")
    assert ran.status == 2 and not (tmp_path / "out").exists(), ran.said
