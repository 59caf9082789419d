"""The picture of a map: every marker with its number, its sigma and where it is; cameras, and what turn.js turns."""

from __future__ import annotations

import re

import numpy as np

from robocal.geometry import se3, so3
from robocal.report.map_scene import draw_map
from robocal.report.page import page
from robocal.report.sections import Figure, Section
from robocal.vision.maps import MarkerMap


def wall(count=6, sigma=1e-4):
    """Markers on a wall that looks along x, the later ones known less well."""
    turn = so3.log(np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]))
    vector = np.array([[0.0, 0.2 * i, 0.5, *turn] for i in range(count)])
    covariance = np.diag(np.repeat((sigma * (1 + np.arange(count))) ** 2, 6))
    return MarkerMap(
        tuple(str(10 * i) for i in range(count)), np.full(count, 0.12), vector, covariance if sigma else None
    )


def test_every_marker_is_drawn_with_number_and_sigma():
    drawn = draw_map(wall(), marked=("30",))
    assert (
        len(re.findall(r'<path class="tag( moved)?"', drawn)) == 6 and len(re.findall('class="tag moved"', drawn)) == 1
    )
    for i in range(6):
        assert f">{10 * i}</text>" in drawn and f"<title>{10 * i}: sigma 0.{i + 1}" in drawn
    assert drawn.count('class="ellipse"') == 6 and "Marked: 30." in drawn


def test_without_covariance_nothing_is_claimed():
    drawn = draw_map(wall(sigma=0))
    assert "sigma" not in drawn and 'class="ellipse"' not in drawn and drawn.count('class="tag blank"') == 6


def test_printed_sides_are_seen_and_stand_upright():
    """Corner 0 is drawn left of corner 1 and above corner 3."""
    drawn = draw_map(wall())
    places = re.findall(r'<path class="tag" d="M(\S+) (\S+)L(\S+) (\S+)L\S+ \S+L(\S+) (\S+)z"', drawn)
    assert len(places) == 6
    for x0, y0, x1, _, _, y3 in [tuple(map(float, p)) for p in places]:
        assert x0 < x1 and y0 < y3


def test_cameras_and_many_of_them():
    cameras = np.tile(se3.from_vector([2.0, 0.5, 0.5, 0, 0, 0]), (1000, 1, 1))
    drawn = draw_map(wall(), cameras)
    assert 200 <= drawn.count('class="camera"') <= 300 and "1000 cameras, 250 of them drawn" in drawn
    assert "NaN" not in drawn and "nan" not in drawn


def test_it_turns_on_a_page():
    shown = page("map", [Section.of("The map", Figure(draw_map(wall())))], kind="map")
    assert "data-eye" in shown and "scene.state" in shown


def test_one_marker_alone():
    assert "1 markers" in draw_map(wall(1))
