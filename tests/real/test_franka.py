"""Franka FR3: a camera on the hand sees a board; the nominal arm of the catalogue, 70 / 30."""

from __future__ import annotations

import pytest
from real.splits import report, splits

from robocal.files.dataset import read_dataset
from robocal.files.robot import open_robot

DATA = """robocal: 1
kind: {kind}
file: {file}
orientation: {{columns: board_T_camera, form: matrix}}
frame: {{name: board, free: true}}
"""


@pytest.fixture
def load(shared_data, tmp_path):
    def read(kind):
        text = DATA.format(kind=kind, file=shared_data / "franka-fr3-board" / "poses.csv")
        (tmp_path / "data.yaml").write_text(text)
        robot = open_robot("fr3").chain
        data = read_dataset(tmp_path / "data.yaml", robot).dataset
        assert len(data.configurations) == 114
        return robot, data

    return read


def test_positions(load):
    before, after = report("FR3, positions, 80 poses fitted, 34 held out", splits(*load("position"), 80, 34))
    assert 2.7 < before < 3.1
    assert after <= 1.25


def test_full_pose(load):
    before, after = report("FR3, full pose, 80 poses fitted, 34 held out", splits(*load("pose"), 80, 34))
    assert after <= 1.4 < before
