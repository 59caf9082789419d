"""predict and drift: run folders in, bands and a verdict out; what does not fit is said."""

from __future__ import annotations

import csv
import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from called import called, drift, identify, predict, simulate
from run_folders import earlier

from robocal.arms.groups import add
from robocal.errors import FileError, FormatError, InputError, ModelError
from robocal.files.covariance import read_covariance
from robocal.files.robot import open_robot, read_robot
from robocal.remarks.code import Code
from robocal.session.pose_prediction import _condition_remarks

POSES = "q1 [deg],q2 [deg],q3 [deg],q4 [deg],q5 [deg]\n0,0,0,0,0\n30,-20,10,5,60\n-90,50,-30,60,-50\n"


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Two calibrations of one true arm, and one after its second link grew by 0.3 mm."""
    folder = tmp_path_factory.mktemp("trust")
    simulate("rv-2aj", folder / "one", poses=50, seed=1)
    truth = folder / "one" / "truth.yaml"
    grown = 1e3 * read_robot(truth).chain.table["j3.d"].value + 0.3
    same = {"length_error": 0.0, "angle_error": 0.0, "poses": 50}
    simulate(str(truth), folder / "two", seed=2, **same)
    simulate(str(truth), folder / "three", seed=3, settings=[f"j3.d={grown}"], **same)
    robot = str(folder / "one" / "robot.yaml")
    for name in ("one", "two", "three"):
        choices = {"leave_one_out": False}
        identify(robot, [str(folder / name / "data.yaml")], choices, output=folder / f"run-{name}")
    (folder / "poses.csv").write_text(POSES)
    return folder


def test_predictions_hold_the_truth(place):
    found = predict(place / "run-one", place / "poses.csv", output=place / "predicted.csv")
    true = read_robot(place / "one" / "truth.yaml").chain.pose(
        np.radians([[0, 0, 0, 0, 0], [30, -20, 10, 5, 60], [-90, 50, -30, 60, -50]])
    )
    for row, pose in zip(found.poses.rows, true, strict=True):
        # Bands are of the shape: the place of the base itself is known to its expected errors only.
        assert np.linalg.norm([row[a] - 1e3 * p for a, p in zip("xyz", pose[:3, 3], strict=True)]) < 5
        assert 0.005 < row["band"] < 0.2 < 0.9 * row["band_new"] + 0.2
        assert row["band"] < row["band_new"]
    assert found.relative_to != "base"
    written = list(csv.DictReader((place / "predicted.csv").read_text().splitlines()))
    assert [float(r["band [mm]"]) for r in written] == pytest.approx([r["band"] for r in found.poses.rows])
    whole = predict(place / "run-one", place / "poses.csv", absolute=True)
    assert all(w["band"] > r["band"] for w, r in zip(whole.poses.rows, found.poses.rows, strict=True))
    for row, pose in zip(whole.poses.rows, true, strict=True):
        error = np.linalg.norm([row[a] - 1e3 * p for a, p in zip("xyz", pose[:3, 3], strict=True)])
        assert error < 1.5 * row["band"]


def test_what_the_poses_do_not_say_and_the_model_asks_is_told(place):
    """The side from which a joint with backlash arrives has no mean worth the name."""
    known = replace(
        read_covariance(place / "run-one" / "covariance.json"),
        conditions={"approach.j2": 0.1, "approach.j3": 0.2, "time": 7.0},
    )
    robot = open_robot("rv-2aj")
    chain = add(robot.chain, "backlash", {})
    q = np.zeros((2, 5))
    still = replace(robot, chain=chain)
    loose = replace(robot, chain=chain.with_values({"j2.backlash": 1e-3}))
    assert _condition_remarks(still, known, q, {}) == []
    (said,) = _condition_remarks(loose, known, q, {})
    assert said.code is Code.CONDITIONS_ASSUMED and said.numbers["columns"] == ("approach.j2",)
    assert _condition_remarks(loose, known, q, {"approach.j2": np.ones(2)}) == []


def test_covariance_survives_its_file(place):
    known = read_covariance(place / "run-one" / "covariance.json")
    text = json.loads((place / "run-one" / "covariance.json").read_text())
    np.testing.assert_array_equal(known.total.covariance, text["covariance"])
    rows = known.rows
    assert rows.joints.shape == (50, 5) and rows.jacobian.shape == (150, len(rows.names)) and rows.thinned == 1
    # The rows are those of the minimum: they pull nowhere.
    pull = np.linalg.norm(rows.jacobian.T @ rows.residual / np.linalg.norm(rows.jacobian, axis=0))
    assert pull < 1e-3 * np.linalg.norm(rows.residual)
    assert (
        known.total.names == tuple(text["names"])
        and known.joints.shape == (5, 2)
        and known.noise["m"] > 0
        and not known.placed
    )
    result = json.loads((place / "run-one" / "result.json").read_text())
    sigma = dict(zip(known.total.names, known.total.sigma, strict=True))
    for p in result["parameters"]:
        if p["sigma"] is not None:
            assert p["delta"] == pytest.approx(p["identified"] - p["nominal"], abs=1e-9)
        # Of rotations the covariance speaks of turns, the table of components.
        if p["sigma"] is not None and p["name"].rpartition(".")[2] not in ("rx", "ry", "rz"):
            unit = {"mm": 1e-3, "deg": np.pi / 180}[p["unit"]]
            assert p["sigma"] * unit == pytest.approx(sigma[p["name"]], rel=0.2)
            assert p["interval"][0] < p["identified"] < p["interval"][1]


def test_the_map_is_written_and_drawn(place):
    page = (place / "run-one" / "report.html").read_text()
    assert "Where it can be trusted" in page and "95 % band of the corrected model" in page
    rows = list(csv.DictReader((place / "run-one" / "accuracy_map.csv").read_text().splitlines()))
    assert {r["slice"] for r in rows} == {"horizontal", "vertical"} and len(rows) > 300
    error, band = (np.array([float(r[k]) for r in rows]) for k in ("nominal_error_mm", "band_mm"))
    assert 0 < band.max() < 0.3 < error.max() < 10
    again = called("report", folder=place / "run-one", output=place / "again.html").result.read_text()
    assert again.count("<path fill=") == page.count("<path fill=") > 8  # one scale of colours for both maps


def test_no_drift_and_drift(place):
    same = drift(place / "run-one", place / "run-two")
    assert same.document["verdict"]["status"] == "unchanged" and same.drift.p_value > 0.01
    assert same.drift.difference.low == 0 and same.document["change"]["high"] < 0.1 and same.drift.scatter.same == 0
    codes = [r["code"] for r in same.document["verdict"]["remarks"]]
    assert codes[0] == "change-below" and len(codes) == len(same.document["verdict"]["reasons"])
    finer = drift(place / "run-one", place / "run-two", matters="0.02mm")
    assert finer.status == "possible" and finer.reasons[0].code is Code.CHANGE_OPEN
    moved = drift(place / "run-one", place / "run-three", output=place / "drift")
    document = json.loads((place / "drift" / "drift.json").read_text())
    assert document["verdict"]["status"] == "drifted" and moved.drift.p_value < 1e-6
    assert 0.1 < document["workspace"]["rms"] < 0.4 and document["workspace"]["limit"] < 0.1
    change = document["change"]
    assert 0.1 < change["low"] < change["change"] < change["high"] < 0.4 and change["p_value"] < 1e-3
    assert drift(place / "run-one", place / "run-three", matters="1mm").status == "unchanged"
    single = {c["name"]: c for c in document["single_causes"]}
    assert (
        single["j3.d"]["change"] == pytest.approx(0.3, abs=4 * single["j3.d"]["sigma"])
        and single["j3.d"]["p_rest"] > 0.01
    )
    with_tool = drift(place / "run-one", place / "run-three", new_tool=True)
    assert with_tool.status == "drifted" and not any(c.name.startswith("tool.") for c in with_tool.drift.changes)


def test_the_same_data_twice_prove_nothing(place):
    found = drift(place / "run-one", place / "run-one")
    assert found.status == "possible" and [r.code for r in found.void] == [Code.SAME_MEASUREMENTS]
    assert found.document["verdict"]["reasons"] == [str(found.void[0])]


def test_a_refused_run_and_one_without_rows_say_so(place, tmp_path):
    folder = earlier(Path(shutil.copytree(place / "run-two", tmp_path / "run")))
    known = json.loads((folder / "covariance.json").read_text())
    del known["rows"]
    (folder / "covariance.json").write_text(json.dumps(known))
    found = drift(place / "run-one", folder)
    assert found.drift.scatter is None and Code.ROWS_NOT_KEPT in [w.code for w in found.warnings]
    result = (folder / "result.json").read_text()
    assert '"status": "improved"' in result
    (folder / "result.json").write_text(result.replace('"status": "improved"', '"status": "refused"', 1))
    found = drift(place / "run-one", folder)
    assert found.status == "possible" and [r.code for r in found.void] == [Code.RUN_REFUSED]


def test_what_cannot_be_compared_is_said(place, tmp_path):
    with pytest.raises(FileError, match="not a run folder"):
        drift(place / "run-one", place / "nowhere")
    simulate("irb-120", tmp_path / "other", poses=40, seed=1)
    identify(
        str(tmp_path / "other" / "robot.yaml"),
        [str(tmp_path / "other" / "data.yaml")],
        {"leave_one_out": False},
        output=tmp_path / "run",
    )
    with pytest.raises(ModelError, match="different robots"):
        drift(place / "run-one", tmp_path / "run")
    choices = {"leave_one_out": False}
    identify(
        str(place / "run-one" / "calibrated.yaml"),
        [str(place / "two" / "data.yaml")],
        choices,
        output=tmp_path / "again",
    )
    with pytest.raises(ModelError, match="different nominal models"):
        drift(place / "run-one", tmp_path / "again")
    (earlier(tmp_path / "run") / "covariance.json").unlink()
    with pytest.raises(FileError, match="does not contain the uncertainty"):
        predict(tmp_path / "run", place / "poses.csv")


@pytest.mark.parametrize(
    ("old", "new"),
    [('"names"', '"nams"'), ('"robocal": 1', '"robocal": 2'), ("[", "{"), ('"expected": [', '"expected": [1.0, ')],
)
def test_a_damaged_covariance_is_refused(place, tmp_path, old, new):
    folder = earlier(Path(shutil.copytree(place / "run-one", tmp_path / "run")))
    file = folder / "covariance.json"
    file.write_text(file.read_text().replace(old, new, 1))
    with pytest.raises(InputError, match=r"covariance\.json"):
        predict(folder, place / "poses.csv")


def test_poses_need_joints(place, tmp_path):
    (tmp_path / "p.csv").write_text("x [mm],y [mm],z [mm]\n1,2,3\n")
    with pytest.raises(FormatError, match="no joint values"):
        predict(place / "run-one", tmp_path / "p.csv")
