"""robocal cable drift: what it says of runs, of robot files, and of what cannot be compared."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from cables.cable_robots import published
from cables.precise import measured
from cli.runs import robocal
from cli.test_cable_identify import LENGTHS, POSES, table
from listings import rows_of

from robocal.files.cable.write import describe_cable


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    """Three runs: as it was, the same robot again, and with c6 moved by 5 mm along x."""
    folder = tmp_path_factory.mktemp("drift")
    robot = published("laval")
    draw = np.random.default_rng(0)
    nominal = robot.with_values(
        {n: robot.table[n].value + 0.01 * draw.normal() for n in robot.table.names if ".b" not in n}
    )
    (folder / "robot.yaml").write_text(describe_cable(nominal) + "calibrate: {free: [ax, ay, az, l0]}\n")
    rng = np.random.default_rng(3)
    moved = robot.with_values({"c6.ax": robot.table["c6.ax"].value + 5e-3})
    for name, truth in (("first", robot), ("same", robot), ("moved", moved)):
        data = measured(truth, rng, 60)
        length, pose = data.observations
        ids, home = data.configurations.ids, folder / name
        home.mkdir()
        (home / "lengths.csv").write_text(
            table([f"{c} [mm]" for c in robot.cables], ids, 1e3 * length.value.reshape(-1, 8))
        )
        names = ["x [mm]", "y [mm]", "z [mm]", "rx [rad]", "ry [rad]", "rz [rad]"]
        (home / "poses.csv").write_text(table(names, ids, pose.value * np.repeat([1e3, 1.0], 3)))
        (home / "lengths.yaml").write_text(
            LENGTHS.replace("COLUMNS", ", ".join(robot.cables)).replace("sigma: 1", "sigma: 0.5")
        )
        (home / "poses.yaml").write_text(
            POSES.replace("sigma: 0.0002", "sigma: 0.00035").replace("free: true", "free: false")
        )
        ran = robocal(
            "identify", folder / "robot.yaml", home / "lengths.yaml", home / "poses.yaml", "-o", home / "run", "--json"
        )
        assert ran.status in (0, 3), ran.remarks
    return folder


def run(cell, *names):
    return [cell / name / "run" for name in names]


def test_the_anchor_that_moved_is_named(cell, tmp_path):
    out = tmp_path / "out"
    ran = robocal("cable", "drift", *run(cell, "first", "same", "moved"), "--zeros-unchanged", "-o", out, "--json")
    assert ran.status == 0, ran.remarks
    found = json.loads(ran.out)
    assert [c["moved"] for c in found["compared"]] == [[], ["c6"]]
    assert found["compared"][1]["cables"]["c6"]["shift_mm"][0] == pytest.approx(5.0, abs=2.0)
    assert json.loads((out / "drift.json").read_text())["compared"] == found["compared"]
    read = [Path(i["file"]).name for i in found["provenance"]["inputs"]]
    assert read == ["calibrated.yaml", "covariance.json"] * 3
    # The page answers first: which anchor moved since which run, and what to do.
    first = (out / "report.html").read_text().partition("<h2")[0]
    assert "same/run: none, as far as these runs can tell; moved/run: c6" in first, first
    assert "<dt>Next</dt>" in first and "calibrate again" in first


def test_the_terminal_says_it(cell):
    ran = robocal("cable", "drift", *run(cell, "first", "moved"), "--zeros-unchanged")
    words = " ".join(ran.out.split())
    assert ran.status == 0 and "the frame anchor of c6 moved:" in words and "detected with 95 % certainty from" in words


def test_with_free_zeros_the_line_of_sight_is_said_to_be_worst(cell):
    ran = robocal("cable", "drift", *run(cell, "first", "same"), "--json")
    (one,) = json.loads(ran.out)["compared"]
    assert not one["moved"]
    assert all(c["smallest_mm"]["along"] > 3 * c["smallest_mm"]["across"] for c in one["cables"].values())
    said = robocal("cable", "drift", *run(cell, "first", "same"))
    assert "where anchor and zero look alike" in " ".join(said.out.split())


def test_a_sensor_set_anew_is_anchor_or_zero(cell, tmp_path):
    """The zero of c4 is 10 mm elsewhere in the second run."""
    home = tmp_path / "reset"
    shutil.copytree(cell / "same", home, ignore=shutil.ignore_patterns("run"))
    rows = list(csv.reader((home / "lengths.csv").read_text().splitlines()))
    for row in rows[1:]:
        row[4] = f"{float(row[4]) - 10:.9g}"
    (home / "lengths.csv").write_text("\n".join(",".join(r) for r in rows) + "\n")
    ran = robocal(
        "identify", cell / "robot.yaml", home / "lengths.yaml", home / "poses.yaml", "-o", home / "run", "--json"
    )
    assert ran.status in (0, 3), ran.remarks
    ran = robocal("cable", "drift", cell / "first" / "run", home / "run")
    assert ran.status == 0 and "anchor or zero of c4 changed along its line of sight" in " ".join(ran.out.split())


def test_poses_of_a_run_hold_what_its_calibration_leaves(cell):
    """Of a calibrated robot's own file they hold the noise of the lengths alone."""
    alone = cell / "copy.yaml"
    shutil.copy(cell / "first" / "run" / "calibrated.yaml", alone)
    said = []
    for robot in (alone, cell / "first" / "run"):
        ran = robocal("cable", "forward", robot, cell / "first" / "lengths.csv", "--sigma", "0.0005", "--json")
        assert ran.status == 0, ran.remarks
        found = json.loads(ran.out)
        said.append(np.array([p["sigma_position"] for p in rows_of(found["poses"])]))
        assert ("calibration" in ran.remarks) == (robot != alone)
    assert (said[1] > said[0]).all() and (said[1] < 5 * said[0]).all()


def test_history_grows_and_holds_a_run_once(cell, tmp_path):
    place = tmp_path / "laval.csv"
    for names in (("first", "same"), ("first", "moved"), ("first", "moved")):
        assert robocal("cable", "drift", *run(cell, *names), "--history", place).status == 0
    rows = list(csv.DictReader(place.read_text().splitlines()))
    assert {r["run"].split("/")[-2] for r in rows} == {"first", "same", "moved"} and len(rows) == 3 * 32
    assert all(float(r["sigma"]) > 0 and r["unit"] in ("m", "mm") and r["started"] for r in rows)
    place.write_text("a,b\n1,2\n")
    ran = robocal("cable", "drift", *run(cell, "first", "same"), "--history", place)
    assert ran.status == 2 and "no history" in ran.remarks and place.read_text() == "a,b\n1,2\n"


def test_robot_files_show_how_calibrations_scatter(cell):
    files = [cell / name / "run" / "calibrated.yaml" for name in ("first", "moved")]
    copies = []
    for i, f in enumerate(files):
        copies.append(cell / f"alone{i}.yaml")
        shutil.copy(f, copies[-1])
    ran = robocal("cable", "drift", *copies, "--json")
    found = json.loads(ran.out)
    assert ran.status == 3 and not found["compared"] and found["scatter_mm"]["component"] > 0
    assert "not known" in ran.remarks


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (("first",), "one calibration alone cannot be compared"),
        (("first", "first"), "same run twice"),
        (("first", "nowhere"), "nowhere"),
    ],
)
def test_what_cannot_be_compared_is_refused(cell, names, words):
    ran = robocal("cable", "drift", *run(cell, *names))
    assert ran.status == 2 and words in ran.remarks, ran.remarks


def test_other_robots_are_no_calibrations_of_this_one(cell, tmp_path):
    other = tmp_path / "other.yaml"
    other.write_text((cell / "robot.yaml").read_text().replace("c8", "d8"))
    ran = robocal("cable", "drift", cell / "first" / "run", other)
    assert ran.status == 2 and "different robots" in ran.remarks


def test_without_an_instrument_on_the_base_the_base_may_differ(cell, tmp_path):
    """Encoders alone from another nominal robot: nothing moved, and none of what the base differs by is an anchor's."""
    shutil.copy(cell / "robot.yaml", tmp_path)
    shutil.copy(cell / "same" / "lengths.csv", tmp_path)
    shutil.copy(cell / "same" / "lengths.yaml", tmp_path)
    ran = robocal("identify", tmp_path / "robot.yaml", tmp_path / "lengths.yaml", "-o", tmp_path / "run")
    assert ran.status in (0, 3)
    ran = robocal("cable", "drift", cell / "first" / "run", tmp_path / "run", "--json")
    found = json.loads(ran.out)["compared"][0]
    assert found["base"] is not None and found["moved"] == [] and "no instrument stood on the base" in ran.remarks


def test_runs_that_share_measurements_are_told_and_not_called_the_same(cell, tmp_path):
    home = tmp_path / "other"
    shutil.copytree(cell / "first", home)
    shutil.rmtree(home / "run")
    shutil.copy(cell / "same" / "lengths.csv", home)
    ran = robocal("identify", cell / "robot.yaml", home / "lengths.yaml", home / "poses.yaml", "-o", home / "run")
    ran = robocal("cable", "drift", cell / "first" / "run", home / "run")
    assert ran.status != 2 and "identified from poses.csv, as the first run was" in ran.said


def test_a_history_is_completed_and_never_doubled(cell, tmp_path):
    history = tmp_path / "h.csv"
    call = ("cable", "drift", *run(cell, "first", "same"), "--history", history)
    robocal(*call)
    whole = history.read_text()
    lines = whole.splitlines()
    history.write_text("\n".join([*lines[:9], *lines[12:]]) + "\n")
    robocal(*call)
    assert sorted(history.read_text().splitlines()) == sorted(lines)
    shutil.copytree(cell / "first" / "run", tmp_path / "copy")
    robocal("cable", "drift", tmp_path / "copy", cell / "same" / "run", "--history", history)
    assert len(history.read_text().splitlines()) == len(lines)
    for wrong, words in (("abc", "not a number"), ("nan", "not a number")):
        cells = lines[1].split(",")
        history.write_text("\n".join([lines[0], ",".join([*cells[:6], wrong, cells[7]])]) + "\n")
        ran = robocal(*call)
        assert ran.status == 2 and words in ran.remarks and "row 2" in ran.remarks


def test_drift_compares_runs_of_a_cable_robot_as_cable_drift_does(cell, tmp_path):
    runs = run(cell, "first", "moved")
    found = [json.loads(robocal(*verb, *runs, "--json").out) for verb in (("drift",), ("cable", "drift"))]
    for each in found:
        del each["provenance"]["command"]
    assert found[0] == found[1] and found[0]["compared"]
    words = [robocal(*verb, *runs).out for verb in (("drift",), ("cable", "drift"))]
    assert words[0] == words[1]
    out = tmp_path / "out"
    assert robocal("drift", *runs, "-o", out, "--history", tmp_path / "h.csv").status == 0
    assert {p.name for p in out.iterdir()} == {"drift.json", "report.html"} and (tmp_path / "h.csv").is_file()
    for option in (("--new-tool",), ("--matters", "1mm")):
        ran = robocal("drift", *runs, *option)
        assert ran.status == 2 and "for arms" in ran.remarks


def test_a_run_beside_the_truth_has_errors_as_large_as_its_sigmas_say(cell):
    """Cable robots too: anchors and zeros, cable by cable."""
    truth = cell / "truth.yaml"
    truth.write_text(describe_cable(published("laval")))
    ran = robocal("drift", cell / "same" / "run", truth, "--json")
    found = json.loads(ran.out)
    assert ran.status == 0 and found["verdict"]["consistent"] and not found["far"]
    groups = {g["group"]: g for g in found["groups"]}
    assert set(groups) == {"all", *(f"c{i}" for i in range(1, 9))} and groups["all"]["n"] == 32
    moved = json.loads(robocal("drift", cell / "moved" / "run", truth, "--json").out)
    assert max(moved["groups"][1:], key=lambda g: g["chi2"])["group"] == "c6"
    bare = robocal("drift", cell / "first" / "run", cell / "first" / "run" / "calibrated.yaml")
    assert bare.status == 2 and "no truth" in bare.remarks
