"""Numbers and pictures: digits, scales, what is drawn and what is said about it."""

from __future__ import annotations

import json
import math
import re
import xml.etree.ElementTree as ET
from typing import Any

import numpy as np
import pytest
from report import samples
from report.markup import Page

from robocal.prove.shape import RobotShape, ShapeLine
from robocal.remarks.code import Code
from robocal.report import matrix, numbers, pictures, svg
from robocal.report.arrows import arrows, machine_rows
from robocal.report.error_tables import _worst, errors_table
from robocal.report.fitted import chi2_word
from robocal.report.html import html
from robocal.report.identified import report
from robocal.report.parameter_tables import parameters
from robocal.report.pictures import before_after, per_pose
from robocal.report.proof import times_smaller, verdict
from robocal.report.sections import Figure, Folded, Noted, Section, Table
from robocal.report.series import pairs, three

SVG = "{http://www.w3.org/2000/svg}"


@pytest.mark.parametrize(
    ("size", "places"),
    [(0.0123, 3), (0.0994, 3), (0.0996, 2), (0.15, 2), (1.0, 1), (9.96, 0), (150.0, 0), (math.inf, 2), (0.0, 2)],
)
def test_sigma_decides_the_digits(size: float, places: int) -> None:
    assert numbers.decimals(size) == places


def test_numbers_in_print() -> None:
    assert numbers.significant(2.9134) == "2.91" and numbers.significant(0.06213) == "0.0621"
    assert numbers.significant(-1234.5) == "\u22121234" or numbers.significant(-1234.5) == "\u22121235"
    assert numbers.significant(4.1e7) == "4.10·10⁷" and numbers.significant(2e-7, 2) == "2.0·10⁻⁷"
    assert numbers.with_decimals(-0.0004, 2) == "0.00"
    assert [numbers.significant(v) for v in (None, math.nan, math.inf, "3", True)] == ["–"] * 5
    assert numbers.with_unit("0.3", "deg") == "0.3°" and numbers.with_unit("0.3", "mm") == "0.3\u00a0mm"


def test_decimal_points_stand_below_one_another() -> None:
    column = numbers.align(["1.25", "−10.5", "300", "–"])
    ends = [len(t) - (t + ".").index(".") if "." in t else len(t) - len(t.rstrip("\u2007\u2008")) for t in column]
    assert len(set(ends)) == 1


def test_names_are_drawn_together() -> None:
    assert numbers.ranges(["p008", "p009", "p010", "p012", 3, 4]) == "p008 to p010, p012, 3, 4"
    assert numbers.ranges([1, 2, 3, 4, 9]) == "1 to 4, 9"
    assert numbers.ranges([]) == ""


def test_ticks_are_round_and_inside() -> None:
    assert svg.nice_ticks(0, 10) == [0, 2, 4, 6, 8, 10]
    assert svg.nice_ticks(-430, 430, 4) == [-400, -200, 0, 200, 400], "0 alone shows no scale"
    assert all(len(svg.nice_ticks(-a, a, n)) > 1 for a in (0.3, 1.1, 4.9, 7) for n in range(1, 9))
    assert svg.log_ticks(0.05, 8) == pytest.approx([0.05, 0.1, 0.2, 0.5, 1, 2, 5])
    assert svg.log_ticks(1e-9, 1e9)[0] >= 1e-9 * 0.999
    assert svg.span([0.0, -1.0]) is None


def parameter(name: str, **more: object) -> dict[str, object]:
    return {"name": name, "unit": "mm", "nominal": 0.0, "identified": 0.0, "delta": 0.0, "status": "identified"} | more


def parameter_rows(*told: dict[str, object]) -> dict[str, dict[str, object]]:
    """The cells of the table of parameters by name and column, as a page has them."""
    document = samples.empty()[0] | {"parameters": list(told)}
    (made,) = (b.full for b in parameters(samples.result(document)).blocks if isinstance(b, Table))
    return {str(row[0]): dict(zip(made.columns, row, strict=True)) for row in made.rows}


def bar(cell: object) -> tuple[float, float, float]:
    """Low end, dot and high end of a bar, 0 to 96."""
    assert isinstance(cell, Noted)
    low, high = map(float, re.findall(r'class="curve" d="M([-\d.]+) 8H([-\d.]+)"', cell.svg)[0])
    return low, float(re.findall(r'cx="([-\d.]+)"', cell.svg)[0]), high


def test_parameter_row_carries_sigma_and_change() -> None:
    row = parameter("j1.d", nominal=300, identified=300.12345, delta=0.12345, sigma=0.0212)
    got = parameter_rows(row | {"sigma_instrument": 0.0068, "data_share": 0.5})["j1.d"]
    shown = {k: got[k] for k in ("nominal", "identified", "change", "σ as fitted", "σ instrument", "from data")}
    assert list(shown.values()) == ["300.000", "300.123", "+0.123", "0.021", "0.0068", "50 %"]


def test_what_rounds_to_zero_has_no_sign() -> None:
    got = parameter_rows(parameter("j1.d", identified=-0.001, delta=-0.001, sigma=1.0))["j1.d"]
    assert got["identified"] == got["change"] == "0.0"


def test_errors_keep_four_digits_and_say_what_is_missing() -> None:
    document = samples.empty()[0]
    document["residuals"] = {
        "unit": "mm",
        "before": {"mean": 2.9134, "rms": 3.0, "p95": None, "max": 5.0, "n": 3},
        "held_out": {"mean": 0.06213, "rms": None, "p95": None, "max": None, "n": 2},
    }
    made = errors_table(samples.result(document).residuals, "error")
    assert made is not None
    assert [row[1:6] for row in made.rows] == [("2.913", "3.000", "-", "5.000", "3"), ("0.06213", "-", "-", "-", "2")]


def test_series_separate_what_was_seen() -> None:
    _, rows = samples.improved(20, 6)
    assert [(s.key, len(s.values)) for s in three(rows)] == [("before", 20), ("after", 14), ("held", 6)]
    name, found = pairs(rows)
    assert name == "held out" and len(found) == 6
    assert pairs(samples.refused()[1])[0] == "held out in turn"
    del rows["held_out_mm"]
    assert [len(s.values) for s in three(rows)] == [20, 14, 6]
    assert three({}) == []


def test_before_after_stands_alone() -> None:
    text = before_after(samples.improved()[1])
    root = ET.fromstring(text)
    assert root.tag == f"{SVG}svg" and len(text) < 40_000
    said = root.findtext(f"{SVG}title")
    assert said and re.fullmatch(
        r"Position error: \d+ times smaller on measurements that the identification never saw", said
    )
    assert "never saw" not in before_after(samples.refused()[1])
    with pytest.raises(ValueError, match="no errors to draw"):
        before_after({"before_mm": [None]})


@pytest.mark.parametrize("m", [1, 2, 1000])
def test_pictures_are_well_formed_and_stay_inside(m: int) -> None:
    _, rows = samples.improved(m, 0, angle=True)
    drawn = arrows(rows)
    assert drawn is not None
    for text in (
        pictures.histogram(three(rows)),
        pictures.per_pose(three(rows, "angle_", "deg"), "angle_", "deg"),
        *re.findall(r"<svg .*?</svg>", drawn.svg, re.S),
    ):
        root = ET.fromstring(text)
        width, height = (float(v) for v in root.attrib["viewBox"].split()[2:])
        marks = [p.attrib["d"] for p in root.iter(f"{SVG}path")]
        assert marks and "nan" not in text and "inf" not in text
        at = [(float(x), float(y)) for d in marks for x, y in re.findall(r"M(-?[\d.]+) (-?[\d.]+)", d)]
        # An arrow may begin at the edge and point outwards; nothing begins far outside.
        assert all(-10 <= x <= width + 10 and -10 <= y <= height + 10 for x, y in at)


def numbers_of(drawn: Figure) -> dict[str, list[Any]]:
    """What viewer.js reads."""
    found: dict[str, list[Any]] = json.loads(re.findall(r'id="arrow-data">(.*?)</script>', drawn.svg)[0])
    return found


def test_arrows_carry_their_numbers_and_skip_rows_without() -> None:
    _, rows = samples.improved(10, 3)
    rows["dx_after_mm"][4] = None
    drawn = arrows(rows)
    assert drawn is not None
    data = numbers_of(drawn)
    assert len(data["at"]) == len(data["before"]) == len(data["after"]) == len(data["out"]) == 9
    assert max(math.hypot(*p) for p in data["at"]) < 201
    assert "9 arrows" in drawn.svg
    assert arrows({}) is None


def shape_of(lines, tool, instruments=()):
    """The shape of a machine as result.json tells it, in mm."""
    told = [ShapeLine(name=n, points=[list(map(float, p)) for p in points]) for n, points in lines]
    seen = [ShapeLine(name=n, points=[list(map(float, p))]) for n, p in instruments]
    return RobotShape(unit="mm", configuration="p7", lines=told, tool=list(map(float, tool)), instruments=seen)


def test_the_machine_stands_among_its_arrows_and_far_instruments_are_pointed_at() -> None:
    _, rows = samples.improved(10, 3)
    box = np.array([rows[f"{a}_mm"] for a in "xyz"], dtype=float).T
    tool = (box.min(axis=0) + box.max(axis=0)) / 2
    way = [(0, 0, 0), (0, 0, 300), (0, 0, 300), tool]
    drawn = arrows(rows, shape_of([("", way)], tool, [("near", tool + 10), ("far", tool + [0, 90000, 0])]))
    assert drawn is not None and "The arm along the axes of its joints is drawn as found, at p7." in drawn.caption
    data = numbers_of(drawn)
    (robot,) = data["robots"]
    assert "in base coordinates" in drawn.caption and "fitted to the same row" not in drawn.caption
    plain = arrows(rows)
    assert plain is not None and "base coordinates" not in plain.caption, "an earlier version told them otherwise"
    assert arrows(rows, RobotShape(unit="mm", configuration="p7", lines=[], tool=[0.0, 0.0, 0.0])) is not None
    assert len(robot["arm"]) == 1 and len(robot["arm"][0]) == 3, "points that fall on one are one"
    # Machine and arrows share one space: the way ends at the tool, at the same scale.
    middle = np.array(data["bounds"]).mean(axis=0)
    np.testing.assert_allclose(robot["arm"][0][-1], middle, atol=0.1)
    np.testing.assert_allclose(np.array(robot["arm"][0][0]) - middle, -tool * data["scale"], rtol=1e-2, atol=0.5)
    assert [len(ray) for ray in robot["rays"]] == [1, 2] and "far, 90 m away" in drawn.svg and ">near<" in drawn.svg
    assert max(np.linalg.norm(p) for ray in robot["rays"] for p in ray) < 201


def test_a_machine_without_positions_is_drawn_alone_and_at_rows_with_a_slider() -> None:
    _, rows = samples.improved(5, 0)
    bare = {n: [None] * 5 if n.endswith("_mm") and n[0] in "xyzd" else v for n, v in rows.items()}
    cables = [(f"c{i}", [(100 * i, 0, 0), (900 * i, 500, 800)]) for i in (-1, 1)]
    shape = shape_of(cables, (0, 0, 10))
    alone = arrows(bare, shape)
    assert alone is not None and "platform with its cables" in alone.caption and "arrow-row" not in alone.svg
    assert len(numbers_of(alone)["robots"]) == 1 and "error of" not in alone.svg
    assert arrows(bare) is None
    many = machine_rows([shape] * 3, ["a", "<b>", "c"], "Of 9 rows 3 can be shown.")
    data = numbers_of(many)
    assert len(data["robots"]) == len(data["at"]) == 3 and 'max="2"' in many.svg and "Of 9 rows" in many.caption
    assert all(len(r["cables"]) == 2 and len(r["arm"]) == 2 for r in data["robots"]), "the platform reaches its anchors"


@pytest.mark.parametrize("k", [1, 2, 4])
def test_of_many_rows_some_are_drawn_and_it_is_said(k: int) -> None:
    """One in three, and the largest error before and after, wherever in the table they stand."""
    _, rows = samples.improved(4100, 0)
    for place, stage in ((k, "before"), (4099 - k, "after")):
        rows[f"dx_{stage}_mm"][place] = 77.5
    drawn = arrows(rows)
    assert drawn is not None and "Of 4100 rows one in 3 is drawn, and those with the largest errors." in drawn.caption
    data = numbers_of(drawn)
    more = sum(place % 3 != 0 for place in (k, 4099 - k))
    assert len(data["at"]) == len(data["out"]) == 1367 + more and f"{1367 + more} arrows" in drawn.svg
    assert all(any(e[0] == 77.5 for e in data[stage]) for stage in ("before", "after"))
    few = arrows(samples.improved(2000, 0)[1])
    assert few is not None and "is drawn" not in few.caption and len(numbers_of(few)["at"]) == 2000


@pytest.mark.parametrize("k", [0, 1, 500, 2999])
def test_of_many_errors_the_largest_are_drawn_and_it_is_said(k: int) -> None:
    """Two thousand marks or so; the largest of each series and all rows that were set aside are among them."""
    _, rows = samples.improved(3000, 600)
    rows["after_mm"][k] = rows["before_mm"][k] = 55.0
    rows["set_aside"] = ["yes" if i in (7, 8) and i != k else "" for i in range(3000)]
    series = three(rows)
    drawn, share = pictures.drawn_of(series)
    count = sum(len(s.values) for s in series if s.key != "aside")
    assert share == f"Of {count} errors one in 3 is drawn, and the 20 largest of each series."
    assert share in pictures.per_pose(three(rows)) and sum(len(s.values) for s in drawn) < 2100
    for all_of, some in zip(series, drawn, strict=True):
        assert (all_of.key, all_of.name) == (some.key, some.name)
        assert set(np.sort(all_of.values)[-20:]) <= set(some.values) <= set(all_of.values)
        assert all_of.key != "aside" or len(some.values) == len(all_of.values) == 2
    few = three(samples.improved(800, 0)[1])
    assert [len(s.values) for s in pictures.drawn_of(few)[0]] == [800, 800] and pictures.drawn_of(few)[1] == ""


def test_no_error_at_all_is_drawn_as_dots() -> None:
    _, rows = samples.improved(5, 0)
    for name in rows:
        if name.endswith("_mm") and name[0] != "x":
            rows[name] = [0.0] * 5
    drawn = arrows(rows)
    assert drawn is not None and "nan" not in drawn.svg
    assert pictures.histogram(three(rows)) == "" and pictures.per_pose(three(rows)) == ""


def test_convergence_needs_a_line() -> None:
    assert pictures.convergence([]) == pictures.convergence([1.0]) == pictures.convergence([1.0, 0.0]) == ""
    assert "falls from 100 to 1.00 in 2 iterations" in pictures.convergence([100.0, 2.0, 1.0])


def test_correlation_shows_sign_by_shape_and_names_the_strongest() -> None:
    names, rows = ["a", "b", "c"], [[1, 0.9, -0.8], [0.9, 1, None], [-0.8, None, 1]]
    picture, left_out = matrix.correlation(names, rows)
    assert left_out == 0 and 'class="rho plus"' in picture and 'class="rho minus"' in picture
    assert matrix.strongest(names, rows) == [("a", "b", 0.9), ("a", "c", -0.8)]
    many = [[float(i == j) for i in range(90)] for j in range(90)]
    assert matrix.correlation([f"p{i}" for i in range(90)], many)[1] == 20
    assert matrix.correlation([], []) == ("", 0)


@pytest.mark.parametrize(
    ("chi2", "dof", "source", "said"),
    [
        (310.0, 300, "stated", "as the stated noise predicts"),
        (
            3000.0,
            300,
            "stated",
            "more than the stated noise explains; for the sigmas as fitted, noise is added until this is one",
        ),
        (100.0, 300, "repeats", "less than the stated noise; that sigma looks too large"),
        (
            300.0,
            300,
            "estimated",
            "sigma was taken from these residuals, so this is 1 by construction and tests nothing",
        ),
        (None, 300, "stated", ""),
        (1.0, 0, "stated", ""),
    ],
)
def test_chi2_in_words(chi2: float | None, dof: int, source: str, said: str) -> None:
    assert chi2_word(chi2, dof, source) == said


def test_ratios_in_words() -> None:
    assert times_smaller(2.9, 0.06) == "48 times smaller"
    assert times_smaller(41.0, 46.4) == "1.13 times larger"
    assert times_smaller(1.0, 1.01) == "about the same"
    assert times_smaller(3.0, 1e-13) == "more than 1000 times smaller"
    assert times_smaller(0.0, 1.0) == times_smaller(None, 1.0) == ""


def test_what_to_do_next_is_the_advice_of_the_reasons() -> None:
    def given(*advice: str, status: str = "refused") -> tuple[str, ...]:
        told = [{"code": "c", "sentence": "too few, all in one plane", "advice": a} for a in advice]
        document = samples.empty()[0]
        document["verdict"] = {"status": status, "reasons": ["too few"] * len(told), "remarks": told}
        return verdict(samples.result(document)).advice

    assert given() == given("") == ()
    assert given("Measure more.", status="improved") == ()
    assert given("Measure more.", "", "Measure elsewhere.", "Measure more.") == ("Measure more.", "Measure elsewhere.")


def test_what_was_set_aside_is_marked_and_in_no_mean() -> None:
    """Two gross rows, metres away: a series of their own, no mean, no arrow; the means of the others do not know them."""
    rows = samples.errors(np.random.default_rng(1), 40, 8, 2.0, 0.1, True)
    fit = [i for i, s in enumerate(rows["set"]) if s == "fit"][:1]
    held = [i for i, s in enumerate(rows["set"]) if s == "held_out"][:1]
    clean = {s.key: s for s in three({k: [v for i, v in enumerate(c) if i not in fit + held] for k, c in rows.items()})}
    rows["set_aside"] = ["yes" if i in fit + held else "" for i in range(40)]
    for i in fit + held:
        for name in rows:
            if name.endswith("_mm") and rows[name][i] is not None:
                rows[name][i] = 3000.0
    found = {s.key: s for s in three(rows)}
    assert found["aside"].values.tolist() == [3000.0, 3000.0]
    assert all(found[k].mean == pytest.approx(clean[k].mean) for k in ("before", "after", "held"))
    assert max(a for pair in pairs(rows)[1] for a in pair) < 100
    for draw in (pictures.histogram, pictures.per_pose):
        text = draw(three(rows))
        assert "set aside: 2 values." in text and "mean aside" not in text
    assert 'class="mark aside"' in pictures.per_pose(three(rows))
    drawn = arrows(rows)
    assert drawn is not None and len(numbers_of(drawn)["at"]) == 38
    table = _worst(rows, "", "mm")
    assert table is not None and [row[2] for row in table.rows[:2]] == ["set aside"] * 2
    assert float(str(table.rows[2][5]).split()[0]) < 10


def test_lines_of_means_lie_below_the_points() -> None:
    """A halo keeps them apart from what is behind; drawn last, it would hide points."""
    text = per_pose(three(samples.improved(30, 8)[1]))
    lines = [text.rindex(f'class="mean {k}"') for k in ("before", "after", "held")]
    marks = [text.rindex(f'class="mark {k}"') for k in ("before", "after", "held")]
    assert text.rindex('class="halo"') < max(lines) < min(marks)


def test_a_tracker_far_away_leaves_the_joints_their_scale() -> None:
    far = {"identified": 1600.0, "delta": 1600.0, "sigma": 0.1}
    frame = [
        parameter(f"tracker.{s}", unit="mm" if len(s) == 1 else "deg", **far) for s in ("x", "y", "z", "rx", "ry", "rz")
    ]
    joint = parameter("j2.a", nominal=270, identified=270.4, delta=0.4, sigma=0.05)
    rows = parameter_rows(*frame, joint)
    at = {name: bar(row["change ± 2σ"]) for name, row in rows.items()}
    assert at["j2.a"][2] == pytest.approx(92.0, abs=0.1) and at["tracker.x"][1] > 90


def test_the_band_behind_a_bar_is_what_was_expected() -> None:
    """Two standard deviations on the scale of the change; a wide one fills the field and leaves the scale alone."""
    told = [
        parameter("j1.a", delta=0.4, sigma=0.05, expected=0.1),
        parameter("j2.a", delta=0.2, sigma=0.05, expected=100.0),
    ]
    rows = parameter_rows(*told, parameter("j3.a", delta=0.1, sigma=0.05))
    bands = {}
    for name, row in rows.items():
        cell = row["change ± 2σ"]
        assert isinstance(cell, Noted)
        bands[name] = re.findall(r'class="expected" d="M([-\d.]+) 3h([-\d.]+)', cell.svg)
    assert bands["j1.a"] == [("30.4", "35.2")]  # 44 * 2 * 0.1 / 0.5 = 17.6 on either side of 48
    assert bands["j2.a"] == [("0", "96")] and bands["j3.a"] == []


def test_values_that_no_sigma_gives_digits_to_stand_as_they_were_written() -> None:
    """A length in metres, or a compliance, is not zero."""
    told = [parameter("j1.a", nominal=3e-05, status="prior"), parameter("j1.d", nominal=0.3334568, status="fixed")]
    assert parameter_rows(told[0], parameter("j2.a"))["j1.a"]["nominal"] == "3e-05"
    (folded,) = (
        b for b in parameters(samples.result(samples.empty()[0] | {"parameters": told})).blocks if isinstance(b, Folded)
    )
    (table,) = folded.blocks
    assert isinstance(table, Table) and table.rows[0][1] == "0.3334568"
    assert "3·10⁻⁵" in html([Section.of("", Table(("a", "b"), (("j1.a", "3e-05"),), (1,)))])


def test_what_no_number_is_gives_no_sentence_about_one() -> None:
    document, rows = samples.improved(20, 6)
    document["residuals"]["held_out"]["mean"] = document["residuals"]["after"]["mean"] = None
    document["prediction"] = {"unit": "mm", "mean": 0.1, "p95": 0.2, "max": 0.3, "n": 3, "region": "all"}
    document["prediction"]["coverage"] = [
        {"quantity": "position", "level": 0.95, "components": None, "whole": None, "n": 12}
    ]
    page = Page(report(samples.result(document), rows, None)).text
    assert not re.search(r"\bnan\b", page) and "Not recorded." in page and "went from" not in page


def test_a_combination_without_terms_is_told_by_its_sentence() -> None:
    document, rows = samples.improved(20, 6)
    document["identifiability"]["combinations"] = [{"text": "j5.r has no effect", "code": Code.NO_EFFECT, "terms": []}]
    assert "j5.r has no effect" in report(samples.result(document), rows, None)


def test_every_arrow_has_the_name_of_its_configuration() -> None:
    document, rows = samples.improved(20, 6)
    rows["configuration"][3] = "</script><b>"
    drawn = arrows(rows)
    assert drawn is not None and "</script><b>" not in drawn.svg
    data = json.loads(re.search(r'id="arrow-data">(.*?)</script>', drawn.svg, re.S)[1])
    assert len(data["names"]) == len(data["at"]) and "</script><b>" in data["names"]
