"""`identify --method` and `--compare` on the command line, in the document and in the report."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli.runs import robocal

from robocal.files.result import read_result


@pytest.mark.parametrize("method", ["ekf", "particle"])
def test_filters_are_judged_like_least_squares(case: Path, method: str) -> None:
    ran = robocal("identify", "robot.yaml", "data.yaml", "--json", "--method", method, "--particles", 300)
    lm = robocal("identify", "robot.yaml", "data.yaml", "--json").document
    seen = ran.document
    assert ran.status == 0 and seen["verdict"]["status"] == "improved" and "filter" in seen["method"]
    assert seen["residuals"]["held_out"]["mean"] == pytest.approx(lm["residuals"]["held_out"]["mean"], rel=0.1)
    assert all(p["sigma"] for p in seen["parameters"] if p["status"] == "identified")
    assert bool(seen["residuals"]["leave_one_out"]) == (method == "ekf")
    assert seen["provenance"]["options"]["particles"] == 300


def test_compare_alone_tries_what_is_worth_it(case: Path) -> None:
    ran = robocal("identify", "robot.yaml", "data.yaml", "--compare", "--particles", 100, "-o", "run")
    assert ran.status == 0
    for word in (
        "Estimators on the same split",
        "lse",
        "ekf-100",
        "frames only",
        "predicting the mean",
        "one linear step",
    ):
        assert word in ran.out, word
    written = json.loads((case / "run" / "result.json").read_text(encoding="utf-8"))
    read_result(case / "run" / "result.json")
    found = written["comparison"]
    by = {m["method"]: m for m in found["methods"]}
    assert list(by) == ["lm", "ekf", "particle", "pinv", "lse", "ekf-100"] and found["reference"] == "lm"
    assert by["lm"]["held_out"] == written["residuals"]["held_out"]["mean"] and by["lm"]["sigmas"] is None
    assert by["ekf"]["sigmas"] < 1e-3 and all(m["seconds"] > 0 for m in found["methods"])
    assert found["held_out_before"] == written["residuals"]["held_out_before"]["mean"]
    page = (case / "run" / "report.html").read_text(encoding="utf-8")
    assert "Other estimators on the same measurements" in page and "How linear it was" in page
    assert "Levenberg-Marquardt" in page and "frames only" in page
    again = robocal("report", "run", "-o", "again.html")
    assert again.status == 0 and "Other estimators" in (case / "again.html").read_text(encoding="utf-8")


def test_compare_takes_names_and_the_chosen_method_comes_first(case: Path) -> None:
    seen = robocal("identify", "robot.yaml", "data.yaml", "--json", "--compare", "lse,lm", "--method", "ekf").document
    assert [m["method"] for m in seen["comparison"]["methods"]] == ["ekf", "lse", "lm"]
    assert seen["comparison"]["reference"] == "ekf" and seen["provenance"]["options"]["compare"] == "lse,lm"


def test_without_compare_there_is_no_comparison_but_linearity(case: Path) -> None:
    seen = robocal("identify", "robot.yaml", "data.yaml", "--json").document
    assert seen["comparison"] is None and "compare" not in seen["provenance"]["options"]
    found = seen["linearity"]
    assert found["unit"] == "mm" and found["misleads"] is False
    assert found["fitted"]["neglected"] < found["fitted"]["promised"] < found["fitted"]["before"]


def test_leave_one_out_before_stands_beside_it(case: Path) -> None:
    ran = robocal("identify", "robot.yaml", "data.yaml", "--hold-out", 0)
    assert "leave-one-out, before" in ran.out
    seen = robocal("identify", "robot.yaml", "data.yaml", "--hold-out", 0, "--json").document["residuals"]
    assert seen["leave_one_out"]["mean"] < seen["leave_one_out_before"]["mean"] < seen["constant"]["mean"]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("--method", "efk"), ("--method", "efk", "ekf")),
        (("--compare", "lm,efk"), ("--method", "efk", "ekf")),
        (("--compare", ","), ("--compare", "no method is named")),
        (("--method", "ekf-100", "--loss", "huber"), ("knows no robust loss",)),
        (("--particles", "3"), ("--particles",)),
    ],
)
def test_wrong_words_are_refused(case: Path, words: tuple[str, ...], expected: tuple[str, ...]) -> None:
    robocal("identify", "robot.yaml", "data.yaml", *words).assert_refused(*expected)
