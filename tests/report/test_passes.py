"""How a fit came about, on pages: what is drawn stands in the run folder, and ends where the result does."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest
from cli.runs import robocal

from robocal.report.passes import PANELS
from robocal.report.sections import Figure
from robocal.report.svg import AxisScale, log_ticks, span

EXAMPLES = Path(__file__).parents[2] / "examples"
CABLES = tuple(EXAMPLES / f"cable-calibration/eight/{name}.yaml" for name in ("robot", "lengths", "poses"))
ARM = tuple(EXAMPLES / f"small-arm/{name}.yaml" for name in ("robot", "trial-1"))
POSES = tuple(EXAMPLES / f"instruments/pose/{name}.yaml" for name in ("robot", "data"))


SLOW_CABLES = pytest.param(CABLES, "lm", marks=pytest.mark.slow)


def ran(folder, files, *options):
    """The document, the page and the folder of an identification."""
    done = robocal("identify", *files, "-o", folder / "run", *options)
    assert done.status in (0, 3), done.err
    run = folder / "run"
    return json.loads((run / "result.json").read_text()), (run / "report.html").read_text(), run


def svg_of(page, key):
    """One picture of a page; None where there is none of this name."""
    found = re.search(rf"<svg (?:(?!<svg ).)*?<title id=\"{key}-t\">.*?</svg>", page, re.S)
    return found and found[0]


def lines_of(svg):
    """The places of every line that is drawn, px."""
    paths = re.findall(r'<path class="curve" d="M([^"]+)"', svg)
    return [np.array([[float(v) for v in place.split()] for place in p.split("L")]) for p in paths]


@pytest.mark.parametrize(("files", "method"), [(ARM, "lm"), (ARM, "ekf"), SLOW_CABLES, (ARM, "ekf-100")])
def test_passes_begin_at_nominal_and_end_at_the_result(files, method, tmp_path):
    result, page, _ = ran(tmp_path, files, "--method", method)
    passes = result["fit"]["passes"]
    known = {p["name"]: p for p in result["parameters"]}
    assert passes["after"] == list(range(len(result["fit"]["history"])))
    for p in passes["parameters"]:
        assert p["unit"] == known[p["name"]]["unit"] and p["band"] == []
        assert p["change"][-1] == pytest.approx(known[p["name"]]["delta"], rel=1e-9, abs=1e-12)
        assert not re.match(r"[jc]\d", p["name"]) or p["change"][0] == pytest.approx(0.0, abs=1e-9)
    assert {p["name"] for p in passes["parameters"]} >= {n for n, p in known.items() if p["status"] == "identified"}
    # As many panels as the bound says, each with a value for every pass.
    lines = lines_of(svg_of(page, "passes"))
    assert len(lines) == min(PANELS, len(passes["parameters"])) and {len(at) for at in lines} == {len(passes["after"])}
    assert (result["fit"]["filter"] is not None) == (method == "ekf") == (svg_of(page, "filter-rows") is not None)


@pytest.mark.parametrize("files", [ARM, pytest.param(CABLES, marks=pytest.mark.slow)])
def test_the_greatest_error_is_that_of_the_rows(files, tmp_path):
    """Nothing is held out, so that what the last pass leaves is what residuals.csv has."""
    result, page, run = ran(tmp_path, files, "--hold-out", "0")
    passes = result["fit"]["passes"]
    rows = list(csv.DictReader((run / "residuals.csv").read_text().splitlines()))
    left = [float(r["after_mm"]) for r in rows if r["after_mm"] and r["set_aside"] != "yes"]
    assert passes["unit"] == "mm" and passes["greatest_error"][-1] == pytest.approx(max(left), rel=1e-6)
    # Drawn are these numbers: the height of each point by the labels of the axis.
    svg = svg_of(page, "greatest-error")
    (at,) = lines_of(svg)
    y = AxisScale(*span(passes["greatest_error"]), 206.0, 34.0, log=True)
    np.testing.assert_allclose(at[:, 1], [y(v) for v in passes["greatest_error"]], atol=0.06)
    heights = dict(re.findall(r'<text x="55" y="([\d.]+)" class="tick"[^>]*>([^<]+)</text>', svg))
    assert len(heights) >= 2 and all(abs(y(float(v)) + 4 - float(h)) < 0.06 for h, v in heights.items())
    assert set(map(float, heights.values())) <= set(log_ticks(y.low, y.high))


@pytest.mark.parametrize("files", [ARM, pytest.param(CABLES, marks=pytest.mark.slow)])
def test_the_band_of_a_filter_ends_at_the_interval_that_is_told(files, tmp_path):
    """Of the filter alone, without further passes: its covariance is that of the result."""
    result, page, _ = ran(tmp_path, files, "--method", "ekf", "--iterations", "1")
    known, seen_by_filter = {p["name"]: p for p in result["parameters"]}, result["fit"]["filter"]
    split = result["split"]
    fitted = len(split["fit"]) + len(split["held_out"])  # what is handed back is fitted to everything
    assert (
        seen_by_filter["after"][0] == 0 and seen_by_filter["after"][-1] == fitted and len(seen_by_filter["after"]) <= 42
    )
    assert seen_by_filter["greatest_error"] == []
    for p in seen_by_filter["parameters"]:
        low, high = known[p["name"]]["interval"]
        assert p["change"][-1] == pytest.approx(known[p["name"]]["delta"], rel=1e-9)
        assert p["band"][-1] == pytest.approx((high - low) / 2, rel=1e-6) and p["band"][0] > p["band"][-1]
        assert len(p["band"]) == len(p["change"]) == len(seen_by_filter["after"])
    svg = svg_of(page, "filter-rows")
    assert (
        svg.count('class="expected"')
        == svg.count('class="mark held"')
        == min(PANELS, len(seen_by_filter["parameters"]))
    )


def test_every_estimator_stands_beside_the_others_by_component_and_configuration(tmp_path):
    result, page, run = ran(tmp_path, POSES, "--compare", "lm,ekf,lse")
    rows = list(csv.DictReader((run / "comparison.csv").read_text().splitlines()))
    seen = list(csv.DictReader((run / "residuals.csv").read_text().splitlines()))
    assert len(rows) == 6 * len(seen) and list(rows[0])[-3:] == ["lm", "ekf", "lse"]
    assert {(r["component"], r["unit"]) for r in rows} == {
        *((c, "mm") for c in "xyz"), *((f"r{c}", "deg") for c in "xyz"),
    }  # fmt: skip
    for c in "xyz":
        own = [r for r in rows if r["component"] == c]
        assert [r["configuration"] for r in own] == [r["configuration"] for r in seen]
        assert [r["set"] for r in own] == [r["set"] for r in seen]
        np.testing.assert_allclose([float(r["lm"]) for r in own], [float(r[f"d{c}_after_mm"]) for r in seen], rtol=1e-7)
    # The mean error of each as the table has it.
    for m in result["comparison"]["methods"]:
        parts = [[float(r[m["method"]]) for r in rows if r["component"] == c and r["set"] == "fit"] for c in "xyz"]
        assert np.linalg.norm(parts, axis=0).mean() == pytest.approx(m["after"], rel=1e-6)
    svg = svg_of(page, "estimators")
    assert svg.count(">rms ") == 18 and all(f">{m}</text>" in svg for m in ("lm", "ekf", "lse", "x, mm", "rz, °"))
    sizes = dict(re.findall(r"(\w+, \w+): rms ([\d.]+)", svg))
    x = [float(r["lm"]) for r in rows if r["component"] == "x"]
    assert float(sizes["lm, x"]) == pytest.approx(float(np.sqrt(np.mean(np.square(x)))), rel=0.06)
    # The folder alone draws the page again.
    assert robocal("report", run, "-o", tmp_path / "again.html").status == 0
    assert svg_of((tmp_path / "again.html").read_text(), "estimators") == svg


def test_an_estimator_far_off_does_not_hide_the_others():
    from robocal.report.estimator_rows import side_by_side

    rng = np.random.default_rng(0)
    many = 500
    columns = {
        "configuration": [str(i) for i in range(many)], "set": ["fit"] * many, "component": ["1"] * many, "unit": ["px"] * many,
        "lm": rng.normal(size=many).tolist(), "lse": (1e6 * rng.normal(size=many)).tolist(), "pinv": [None] * many,
    }  # fmt: skip
    made = side_by_side(columns)
    assert isinstance(made, Figure) and "beyond the scale" in str(made.legend) and "some are drawn" in made.caption
    assert len(made.svg) < 40_000 and side_by_side({k: [] for k in columns}) is None


@pytest.mark.slow
def test_pixels_have_a_greatest_error_in_pixels(tmp_path):
    files = tuple(EXAMPLES / f"instruments/pixels/{name}.yaml" for name in ("robot", "data"))
    result, page, run = ran(tmp_path, files, "--hold-out", "0")
    passes = result["fit"]["passes"]
    rows = list(csv.DictReader((run / "residuals.csv").read_text().splitlines()))
    left = max(float(r["after_px"]) for r in rows if r["set_aside"] != "yes")
    assert passes["unit"] == "px" and passes["greatest_error"][-1] == pytest.approx(left, rel=1e-6)
    assert "greatest error, px, logarithmic" in svg_of(page, "greatest-error")


@pytest.mark.slow
def test_a_cable_robot_is_compared_too(tmp_path):
    """Poses of its own are what lm and ekf know; the others say that they do not."""
    result, page, run = ran(tmp_path, CABLES, "--compare", "lm,ekf,pinv")
    methods = {m["method"]: m for m in result["comparison"]["methods"]}
    assert methods["pinv"]["failed"] and methods["ekf"]["held_out"] == pytest.approx(
        methods["lm"]["held_out"], rel=1e-2
    )
    rows = list(csv.DictReader((run / "comparison.csv").read_text().splitlines()))
    assert list(rows[0])[-2:] == ["lm", "ekf"] and {r["component"] for r in rows} >= {"lengths", "x", "y", "z"}
    assert ">lengths, mm</text>" in svg_of(page, "estimators")


def test_a_document_with_numbers_missing_is_drawn_without_them(tmp_path):
    _, _, run = ran(tmp_path, ARM, "--method", "ekf")
    document = json.loads((run / "result.json").read_text())
    fit = document["fit"]
    fit["passes"]["greatest_error"][1], fit["filter"]["after"] = None, [0, 1]
    fit["passes"]["parameters"][0]["change"].pop()
    fit["passes"]["parameters"][1]["change"][0] = None
    (run / "result.json").write_text(json.dumps(document))
    done = robocal("report", run, "-o", tmp_path / "page.html")
    assert done.status == 0, done.err
    page = (tmp_path / "page.html").read_text()
    assert len(lines_of(svg_of(page, "greatest-error"))[0]) == len(fit["passes"]["after"]) - 1
    gone = {p["name"] for p in fit["passes"]["parameters"][:2]}
    assert not any(f">{name}</text>" in svg_of(page, "passes") for name in gone) and svg_of(page, "filter-rows") is None
