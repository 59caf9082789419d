"""The map of the workspace: cells where they belong, one scale per quantity, nothing from nothing."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import pytest

from robocal.report.heat import COLOURS, heat
from robocal.report.tables import coverage, outliers


def columns(rows):
    names = ("slice", "x_mm", "y_mm", "z_mm", "side_mm", "nominal_error_mm", "band_mm", "n")
    return {name: [r[i] for r in rows] for i, name in enumerate(names)}


ROWS = [
    ("horizontal", -100.0, 50.0, 500.0, 50.0, 0.0, 0.1, 3.0),
    ("horizontal", 100.0, 50.0, 500.0, 50.0, 2.0, 0.1, 1.0),
    ("vertical", 0.0, 0.0, 250.0, 50.0, 1.0, 0.2, 2.0),
]


def test_every_cell_is_drawn_once_per_quantity_in_the_colour_of_its_value():
    picture = heat(columns(ROWS))
    tree = ElementTree.fromstring(picture)
    paths = [e for e in tree.iter("{http://www.w3.org/2000/svg}path") if e.get("fill")]
    assert sum(e.get("d").count("M") for e in paths) == 2 * len(ROWS)
    # Errors 0, 2 and 1 of at most 2: first, last and middle colour; bands 0.1, 0.1, 0.2 of 0.2: middle and last.
    assert sorted(COLOURS.index(e.get("fill")) for e in paths) == [0, 5, 5, 9, 9]
    assert "up to 2.00 mm" in picture.replace("\u00a0", " ") and "z = 500" in picture


def test_left_is_left_and_up_is_up():
    tree = ElementTree.fromstring(heat(columns(ROWS[:2])))
    at = {
        e.get("fill"): float(re.match(r"M([-\d.]+)", e.get("d"))[1])
        for e in tree.iter("{http://www.w3.org/2000/svg}path")
        if e.get("fill") in (COLOURS[0], COLOURS[9])
    }
    assert at[COLOURS[0]] < at[COLOURS[9]]


@pytest.mark.parametrize(
    "rows", [[], [("sideways", 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0)], [("vertical", None, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0)], [("vertical", 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0)]]
)  # fmt: skip
def test_nothing_comes_of_nothing(rows):
    assert heat(columns(rows)) == ""


@pytest.mark.parametrize("value", [0.0, 1e-9, 1e9])
def test_any_size_can_be_drawn(value):
    ElementTree.fromstring(heat(columns([("horizontal", 0.0, 0.0, 0.0, 10.0, value, value, 1.0)])))


def test_outliers_and_coverage_in_words():
    row = {
        "configuration": "p1",
        "group": "tracker",
        "target": "",
        "source": "a.csv",
        "row": 7,
        "distance": 12.34,
        "p_value": 0.0,
        "value": [1.0, 2.0],
        "units": ["mm", "mm"],
        "set_aside": True,
        "counted": False,
        "cause": {"code": "cause-zeros", "sentence": "exact zeros"},
    }
    assert outliers({"outliers": [row]})[0] == {
        "configuration": "p1",
        "where": "tracker",
        "file": "a.csv",
        "row": "7",
        "distance": "12.3",
        "p": "< 1e-12",
        "value": "1.000, 2.000 mm",
        "told": "set aside",
        "cause": "exact zeros",
    }
    assert outliers({}) == [] and coverage({}) == []
    said = coverage({"coverage": [{"quantity": "position", "level": 0.95, "components": 0.9, "whole": 0.925, "n": 40}]})
    assert "40 held-out measurements (position), 92" in said[0]
