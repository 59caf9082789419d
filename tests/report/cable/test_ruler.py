"""Pages tell where things are in the unit of the robot's file: the same picture, other numbers."""

from __future__ import annotations

import re

import numpy as np
import pytest
from cables.cable_robots import box
from cli.runs import robocal

from robocal.report.cable.length_unit import METRE, LengthUnit
from robocal.report.cable.plane_sections import section
from robocal.report.cable.scene import scene

MM = LengthUnit("mm", 1e-3)


def test_a_length_in_its_unit():
    assert (METRE.text(1.23456), MM.text(1.23456), LengthUnit("in", 0.0254).text(0.0254)) == ("1.235", "1235", "1.0")
    assert (METRE.point([1, 2, -0.5]), MM.short(0.0123)) == ("(1.000, 2.000, −0.500) m", "12.3 mm")
    assert (METRE.title("x"), MM.title("y"), MM.tick(0.5)) == ("x, m", "y, mm", "500")


def drawn(svg):
    """The paths and the texts of a picture."""
    return re.findall(r' d="([^"]+)"', svg), re.findall(r">([^<>]+)</text>", svg)


@pytest.mark.parametrize(
    "picture", [lambda r: scene(box(), np.eye(4), ruler=r), lambda r: section(box(), [], None, (0, 1), ruler=r)]
)
def test_the_picture_stays_and_its_numbers_change(picture):
    (ways, metres), (same, mm) = (drawn(picture(r)) for r in (METRE, MM))
    assert ways == same and len(metres) == len(mm)
    other = [(a, b) for a, b in zip(metres, mm, strict=True) if a != b]
    assert len(other) >= 4
    for a, b in other:
        numbers = [[float(v) for v in re.findall(r"-?\d+(?:\.\d+)?", t.replace("\u2212", "-"))] for t in (a, b)]
        np.testing.assert_allclose(1e3 * np.array(numbers[0]), numbers[1], atol=10)
        assert "mm" in b or not re.search("[a-z]", b)


@pytest.mark.parametrize("verb", ["workspace", "poses", "tension"])
def test_pages_speak_the_unit_of_the_file(verb, tmp_path):
    robocal("new", "cable", "-o", tmp_path)
    robot, out = tmp_path / "robot.yaml", tmp_path / "out"
    assert "length: mm" in robot.read_text()
    more = {
        "workspace": ("--cells", 7, "--rays", 60),
        "poses": ("-n", 4, "--start", "0,0,1000", "--body", "none"),
        "tension": (),
    }[verb]
    lists = [tmp_path / "poses.csv"] if verb == "tension" else []
    ran = robocal("cable", verb, robot, *lists, *more, "-o", out)
    assert ran.status in (0, 3), ran.said
    text = (out / "report.html").read_text()
    assert re.search(r"\d mm\b", text) and not re.search(r"\d m\b(?!/)", text), re.findall(r".{30}\d m\b", text)
