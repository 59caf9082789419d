"""The size of a print and the lengths of a machine are one factor: named together, until something else tells them apart."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from cli.runs import robocal

EXAMPLES = Path(__file__).parents[2] / "examples"
CODE = "print-beside-lengths"
FREE = "scale: {sigma: 0.3 %, free: true}\n"


def told(*words):
    """The remark, or None."""
    ran = robocal("identify", *words, "--no-leave-one-out", "--json")
    found = [r for r in ran.document["remarks"] if r["code"] == CODE]
    return found[0] if found else None


@pytest.fixture
def arm(tmp_path):
    """Robot and data of an arm under a camera, with the size of the marker free."""
    for file in (EXAMPLES / "instruments" / "pixels").iterdir():
        shutil.copy(file, tmp_path)
    data = tmp_path / "data.yaml"
    data.write_text(data.read_text() + FREE)
    return tmp_path / "robot.yaml", data


# obeys: print-beside-lengths
def test_an_arm_and_its_marker_are_named_together(arm):
    robot, data = arm
    found = told(robot, data)
    assert found["sentence"].startswith("print.size and ") and "(0.30 %)" in found["sentence"]
    lengths = found["numbers"]["names"]
    assert len(lengths) > 2 and all(n.rpartition(".")[2] in ("a", "d", "x", "y", "z") for n in lengths)
    text = data.read_text()
    data.write_text(text.replace(FREE, "scale: known\n"))
    assert told(robot, data) is None
    data.write_text(text)
    assert told(robot, data, "--prior", "length=0.01mm") is None


def test_a_marker_that_is_stated_is_not_named(arm):
    robot, data = arm
    data.write_text(data.read_text().replace(FREE, ""))
    assert told(robot, data) is None


@pytest.mark.slow
def test_drums_that_are_free_and_a_map_are_named_together(tmp_path):
    """Cables measure in m and decide the size of the print, until their drums are free too."""
    for file in (EXAMPLES / "cable-camera").iterdir():
        shutil.copy(file, tmp_path)
    files = [tmp_path / n for n in ("robot.yaml", "lengths.yaml", "pixels.yaml")]
    assert told(*files) is None
    text = files[1].read_text()
    files[1].write_text(text.replace("tension:", "gain: {free: true}\ntension:"))
    assert told(*files)["numbers"]["names"] == ["lengths.gain"]
    files[2].write_text(files[2].read_text().replace(FREE, "scale: known\n"))
    assert told(*files) is None
