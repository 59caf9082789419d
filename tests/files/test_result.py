"""result.json and the run folder: valid against their schema, never NaN, all files or none."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from robocal.errors import FileError, FormatError
from robocal.files import text
from robocal.files.result import (
    FitReport,
    IdentifiabilitySummary,
    ParameterResult,
    Provenance,
    ResidualSummary,
    Result,
    RobotSummary,
    Statistic,
    Verdict,
    read_result,
    schema,
)
from robocal.files.runfolder import RESIDUAL_COLUMNS, write_run

SCHEMA = Path(__file__).parents[2] / "docs" / "result.schema.json"
RESIDUALS = {
    "configuration": ["p1", "p2"],
    "set": ["fit", "held_out"],
    "after_mm": np.array([0.125, np.nan]),
    "held_out_mm": [None, 0.5],
}


def result(**changes):
    statistic = Statistic(mean=np.float64(0.1), rms=0.2, p95=0.3, max=0.4, n=np.int64(5))
    parts = {
        "robot": RobotSummary(name="\u00fc arm", convention="dh", joints=6),
        "method": "least squares",
        "verdict": Verdict(status="improved", reasons=["a reason"]),
        "parameters": [
            ParameterResult(
                name="j1.a",
                unit="mm",
                nominal=1.0,
                identified=np.float64(1.5),
                delta=0.5,
                sigma=float("nan"),
                status="identified",
            )
        ],
        "identifiability": IdentifiabilitySummary(
            rank=np.int64(20), n_free=24, condition=float("inf"), dropped=("base.z",)
        ),
        "residuals": ResidualSummary(unit="mm", before=statistic, after=statistic),
        "fit": FitReport(iterations=4, reason="converged", history=np.array([2.0, 1.0, np.nan])),
        "provenance": Provenance(version="0.1.0", options={"x": float("nan"), "y": (1, 2), "z": np.arange(2)}),
    }
    return Result(**(parts | changes))


def test_round_trip_without_nan(tmp_path):
    place = tmp_path / "result.json"
    place.write_text(result().to_json(), encoding="utf-8")
    assert "NaN" not in place.read_text() and "Infinity" not in place.read_text()
    again = read_result(place)
    assert again.to_json() == result().to_json()
    assert again.parameters[0].sigma is None and again.fit.history == [2.0, 1.0, None] and again.residuals.before.n == 5
    data = json.loads(place.read_text())
    assert data["robocal"] == 1 and data["provenance"]["options"] == {"x": None, "y": [1, 2], "z": [0, 1]}
    contract = {
        "robot", "method", "verdict", "parameters", "identifiability", "residuals", "fit", "split", "correlation", "warnings", "provenance",
    }  # fmt: skip
    assert contract <= set(data)


def test_the_schema_in_the_documentation_is_current():
    assert json.loads(SCHEMA.read_text()) == schema(), (
        "write it anew: python -m robocal.files.result > docs/result.schema.json"
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda t: t.replace('"status": "improved"', '"status": "imroved"'),
            ["verdict.status", "'imroved'", "did you mean 'improved'"],
        ),
        (lambda t: t.replace('"method": "least squares",', ""), ["key method", "missing"]),
        (lambda t: t.replace('"rank": 20', '"rank": "x"'), ["identifiability.rank", "'x'"]),
        (lambda t: t.replace('"robocal": 1', '"robocal": 2'), ["not a result", "found 2"]),
        (lambda t: t.replace("{", "", 1), ["not valid JSON"]),
        (lambda t: "[1]", ["not a result"]),
        (lambda t: "[" * 100_000, ["not valid JSON"]),
        (lambda t: t[: len(t) // 2], ["row", "not valid JSON"]),
    ],
)
def test_faults_of_a_result(tmp_path, change, words):
    place = tmp_path / "result.json"
    place.write_text(change(result().to_json()), encoding="utf-8")
    with pytest.raises(FormatError) as info:
        read_result(place)
    for word in ["result.json", *words]:
        assert word in str(info.value)


def test_a_run_folder(tmp_path):
    folder = tmp_path / "runs" / "first"
    written = write_run(folder, result(), "robocal: 1\n", RESIDUALS, "<html>")
    assert sorted(p.name for p in written) == ["calibrated.yaml", "report.html", "residuals.csv", "result.json"]
    rows = list(csv.DictReader((folder / "residuals.csv").read_text().splitlines()))
    assert (
        tuple(rows[0]) == RESIDUAL_COLUMNS
        and rows[0]["after_mm"] == "0.125"
        and rows[1]["after_mm"] == ""
        and rows[0]["held_out_mm"] == ""
    )
    # What an earlier run left and this one does not have would be a lie.
    write_run(folder, result(), "<robot/>", None, None, robot_name="calibrated.urdf")
    assert sorted(p.name for p in folder.iterdir()) == ["calibrated.urdf", "result.json"]


def test_a_run_folder_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    def full(fd):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(text.os, "fsync", full)
    with pytest.raises(FileError, match="no space left"):
        write_run(tmp_path / "run", result(), "x", RESIDUALS, "<html>")
    assert list(tmp_path.iterdir()) == []


def test_wrong_columns_are_a_mistake_of_the_program(tmp_path):
    with pytest.raises(ValueError, match="did you mean 'after_mm'"):
        write_run(tmp_path, result(), None, {"afterr_mm": []}, None)
    with pytest.raises(ValueError, match="different length"):
        write_run(tmp_path, result(), None, {"set": ["fit"], "after_mm": []}, None)
    assert list(tmp_path.iterdir()) == []


def test_a_result_is_written_without_what_reads_it():
    code = "import sys, robocal.files.result; print('pydantic' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"
