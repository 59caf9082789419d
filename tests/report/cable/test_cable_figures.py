"""Pictures of cable robots: every robot is drawn whole, inside its picture, and nothing in a robot file becomes markup."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from robocal.cables.geometry import CableRobot, cable_robot
from robocal.report.cable.page import Block, page
from robocal.report.cable.scene import scene

SVG = "{http://www.w3.org/2000/svg}"


def robot_of(m: int, degrees: str = "3R3T", plane: str = "xz", names: list[str] | None = None) -> CableRobot:
    """A robot with m cables around a platform of half a metre."""
    turn = 2 * np.pi * np.arange(m) / m + 0.3
    ring = np.stack([2 * np.cos(turn), 1.5 * np.sin(turn), 1.5 + np.where(np.arange(m) % 2, 1.4, -1.2)], axis=1)
    small = np.stack([0.2 * np.cos(turn + 0.4), 0.2 * np.sin(turn + 0.4), 0.1 * np.cos(2.1 * turn)], axis=1)
    if degrees != "3R3T":
        across = 1 if plane == "xz" else 2
        ring[:, across] = small[:, across] = 0.0
        small = small * 0 if degrees == "2T" else small
    limits = np.tile([20.0, 125.0], (m, 1))
    return cable_robot("rig", ring, small, names=names, limits=limits, degrees=degrees, plane=plane, mass=5.0)


@pytest.mark.parametrize("m", range(3, 13))
def test_every_cable_is_drawn(m: int) -> None:
    robot = robot_of(m)
    root = ET.fromstring(scene(robot, robot.home, tension=np.linspace(20, 125, m)))
    found = {p.attrib["data-cable"] for p in root.iter(f"{SVG}path") if "data-cable" in p.attrib}
    assert found == {str(i + 1) for i in range(m)}


def test_nothing_in_a_robot_file_becomes_markup() -> None:
    evil = ['<script>alert("1")</script>', 'a" onload="x', "b&c", "</svg>"]
    robot = robot_of(4, names=evil)
    drawn = scene(robot, robot.home, tension=[30, 40, np.nan, 5], caption="<b>&")
    ET.fromstring(drawn)
    text = page("<i>title</i>", [Block("<u>", "<q>&", drawn, [["<td>", "x"], ["<tr>", "1"]])])
    for bad in ("<script>alert", '" onload="', "<b>&", "<i>title", "<u>", "<q>", "<td><td>", "<tr>1"):
        assert bad not in text
