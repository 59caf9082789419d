"""The map of the workspace: cells where they belong, each quantity on a scale of its own, nothing from nothing."""

from __future__ import annotations

import re
from types import SimpleNamespace as Made
from xml.etree import ElementTree

import pytest

from robocal.report.error_tables import outlier_blocks
from robocal.report.heat import COLOURS, heat


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
    # Each by its own logarithm: errors 0 and 2, then 1, from 1 to 2; bands 0.1, twice in one path, then 0.2.
    assert [COLOURS.index(e.get("fill")) for e in paths] == [0, 9, 0, 0, 9]
    assert "up to 2.00 mm" in picture.replace("\u00a0", " ") and "z = 500" in picture


def test_left_is_left_and_up_is_up():
    small = (*ROWS[0][:5], 1.0, *ROWS[0][6:])
    tree = ElementTree.fromstring(heat(columns([small, ROWS[1]])))
    at: dict[str, float] = {}
    for e in tree.iter("{http://www.w3.org/2000/svg}path"):
        if e.get("fill") in (COLOURS[0], COLOURS[9]):  # the picture on the left comes first
            at.setdefault(e.get("fill"), float(re.match(r"M([-\d.]+)", e.get("d"))[1]))
    assert at[COLOURS[0]] < at[COLOURS[9]]


@pytest.mark.parametrize(
    "rows", [[], [("sideways", 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0)], [("vertical", None, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0)], [("vertical", 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0)]]
)  # fmt: skip
def test_nothing_comes_of_nothing(rows):
    assert heat(columns(rows)) == ""


@pytest.mark.parametrize("value", [0.0, 1e-9, 1e9])
def test_any_size_can_be_drawn(value):
    ElementTree.fromstring(heat(columns([("horizontal", 0.0, 0.0, 0.0, 10.0, value, value, 1.0)])))


def test_strange_rows_in_words():
    row = Made(
        configuration="p1", group="tracker", target="", source="a.csv", row=7, rows=1, distance=12.34, p_value=0.0, value=[1.0, 2.0],
        units=["mm", "mm"], set_aside=True, counted=False, cause=Made(sentence="exact zeros"),
    )  # fmt: skip
    (table,) = outlier_blocks([row]).blocks
    told = ("12.3 sigma", "< 1e-12", "set aside", "exact zeros")
    assert table.full.rows == (("p1", "tracker", "a.csv", "7", "1.000, 2.000 mm", *told),)
    assert "chance" not in table.short.columns
