"""Mistakes in the files of the example with a camera on a platform that reading names, before anything is fitted."""

from __future__ import annotations

import csv
import shutil
from pathlib import Path

import pytest

from robocal.errors import FormatError, ModelError
from robocal.session.inputs import read_inputs

EXAMPLE = Path(__file__).parents[2] / "examples" / "cable-camera"


@pytest.fixture
def read(tmp_path):
    """Reads the example, after a change of pixels.yaml or of the rows of pixels.csv."""

    def after(old="", new="", rows=None):
        for name in ("robot.yaml", "lengths.yaml", "lengths.csv", "pixels.yaml", "pixels.csv"):
            shutil.copy(EXAMPLE / name, tmp_path)
        text = (tmp_path / "pixels.yaml").read_text(encoding="utf-8")
        assert old in text
        (tmp_path / "pixels.yaml").write_text(text.replace(old, new, 1), encoding="utf-8")
        with (tmp_path / "pixels.csv").open(encoding="utf-8") as file:
            head, *cells = csv.reader(file)
        with (tmp_path / "pixels.csv").open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([head, *(cells if rows is None else filter(rows, cells))])
        return read_inputs(tmp_path / "robot.yaml", [tmp_path / "lengths.yaml", tmp_path / "pixels.yaml"])

    return after


def test_the_example_itself_is_read(read):
    assert len(read().data.observations) == 2


def test_width_and_height_of_the_images_exchanged(read):
    """The file has corners beyond what is then the width."""
    with pytest.raises(FormatError, match=r"pixels\.yaml, row \d+, key image: .*exchanged.*expected \[1280, 1024\]"):
        read("image: [1280, 1024]", "image: [1024, 1280]")


def test_a_rotation_in_another_unit_is_named(read):
    with pytest.raises(FormatError, match=r"targets\.m0\.rotation_vector: more than a whole turn.*units\.angle"):
        read("angle: deg", "angle: rad")
    with pytest.raises(FormatError, match=r"key frame\.rotation_vector: more than a whole turn"):
        read("rotation_vector: [180.000000", "rotation_vector: [1800.000000")


def test_one_view_of_every_marker_is_no_data(read):
    """It was a fault in robocal: no row was left."""
    with pytest.raises(ModelError, match=r"no marker is in two views.*found '\d markers of eye'"):
        read(rows=lambda cells: cells[0] == "p0")
