"""Pictures of sweeps: lines of equal value lie where the value is that, and curves show what they are given."""

from __future__ import annotations

import re

import numpy as np

from robocal.report.sweep import Axis, Curve, curves, levels


def marks(svg, series):
    return sum(len(re.findall("M", d)) for d in re.findall(f'class="mark {series}" d="([^"]*)"', svg))


def test_curves_and_what_is_foretold():
    x = Axis("poses", np.array([10.0, 20.0, 100.0, 400.0]))
    a = Curve("squared", np.array([100.0, 50.0, 30.0, np.nan]), np.array([110.0, 50.0, 30.0, 25.0]))
    b = Curve("length", np.array([90.0, 45.0, 20.0, 10.0]))
    svg = curves(x, [a, b], "anchors [mm]", "said", "k")
    assert marks(svg, "before") == 3 + 1 + 3 and marks(svg, "after") == 4 + 1  # the legend, and the panel below
    assert "found over foretold" in svg and svg.count("curve p95") == 1 and "nan" not in svg
    upright = [m.start() for m in re.finditer(r'class="grid" d="M([\d.]+) [\d.]+L\1 ', svg)]
    assert len(upright) > 3 and max(upright) < svg.index('class="mark'), "grids lie under marks"
    assert "found over foretold" not in curves(x, [b], "anchors [mm]", "said", "k")
    assert curves(x, [Curve("none", np.full(4, np.nan))], "anchors [mm]", "said", "k") == ""


def test_words_are_not_joined():
    x = Axis("loss", np.arange(3.0), ("none", "huber", "a < b"))
    svg = curves(x, [Curve("", np.array([1.0, 2.0, 3.0]))], "after [mm]", "said", "k")
    assert "mean before" not in svg and "a &lt; b" in svg and marks(svg, "before") == 3  # no name, no mark for it


def test_levels_of_what_is_found_and_foretold():
    x, y = Axis("a [mm]", np.linspace(0, 2, 9)), Axis("b [mm]", np.linspace(0, 3, 7))
    r = np.hypot(x.values[:, None], y.values)
    svg = levels(x, y, r, 1.1 * r, "mm", "said", "k")
    assert "1 mm" in svg and "curve p95" in svg and "nan" not in svg
    assert levels(x, y, np.full_like(r, np.nan), None, "mm", "said", "k") == ""


def test_trials_scatter_about_their_mean_and_what_is_wanted_is_a_line():
    x, values = Axis("poses", np.array([10.0, 20.0, 30.0])), np.array([0.9, 0.94, 0.96])
    svg = curves(x, [Curve("", values, None, np.array([0.05, 0.02, 0.0]))], "coverage", "said", "k", (0.95, "95 %"))
    (bars,) = re.findall(r'class="scatter" d="([^"]*)"', svg)
    heights = [abs(float(a) - float(b)) for a, b in re.findall(r"M[\d.]+ ([\d.]+)h6m-3 0V([\d.]+)", bars)]
    assert len(heights) == 2 and abs(heights[0] / heights[1] - 2.5) < 0.05 and ">95 %<" in svg
    assert "scatter" not in curves(x, [Curve("", values)], "coverage", "said", "k")
