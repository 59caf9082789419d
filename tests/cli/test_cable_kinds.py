"""Kinds of cable on the command line: from a file to an identified robot, what its file then says, and verbs that refuse."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from cables.kinds import DRUMS, PLANAR, RAILS
from cli.runs import robocal

from robocal.cables.cable_lengths import inverse
from robocal.files.cable.cable_robot import read_cable
from robocal.geometry import se3

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "seen"), [(PLANAR, "position"), (RAILS, "pose"), (DRUMS, "pose")], ids=["sums", "rails", "drums"]
)
def test_the_calibrated_file_is_the_fitted_model(place, text, seen):
    """Every identified number, of segments, rails and drums, is in the file that the run writes."""
    Path("robot.yaml").write_text(text)
    assert robocal("simulate", "robot.yaml", "-n", "40", "--seed", "2", "--frame", "none", "-o", "sim").status == 0
    ran = robocal("identify", "sim/robot.yaml", "sim/lengths.yaml", f"sim/{seen}.yaml", "-o", "run")
    assert ran.status == 0, ran.said
    told = {p["name"]: p for p in json.loads(Path("run/result.json").read_text())["parameters"]}
    file = read_cable("run/calibrated.yaml").robot
    moved = [n for n, p in told.items() if n in file.table and p["status"] == "identified"]
    assert len(moved) >= 6
    robot = read_cable("robot.yaml").robot
    t = se3.from_vector(np.array([[0.2, 0, 1.3, 0, 0, 0], [-0.3, 0, 1.0, 0, 0, 0]]))
    shown = inverse(file, t)[0]
    assert np.abs(shown - inverse(robot, t)[0]).max() > 1e-4
    Path("poses.csv").write_text(
        "time [s],x [m],y [m],z [m],rx [deg],ry [deg],rz [deg]\n0,0.2,0,1.3,0,0,0\n1,-0.3,0,1.0,0,0,0\n"
    )
    ran = robocal("cable", "inverse", "run", "poses.csv", "-o", "lengths.csv")
    assert ran.status == 0, ran.said
    rows = list(csv.DictReader(Path("lengths.csv").read_text().splitlines()))
    assert [float(r["time [s]"]) for r in rows] == [0.0, 1.0]
    written = np.array([[float(r[f"{c} [m]"]) for c in file.cables] for r in rows])
    assert np.abs(written - shown).max() < 1e-12
    truth = read_cable("sim/truth.yaml").robot
    assert np.abs(shown - inverse(truth, t)[0]).max() < 0.3 * np.abs(inverse(robot, t)[0] - inverse(truth, t)[0]).max()


@pytest.mark.parametrize(
    "words",
    [
        ("cable", "contact", "robot.yaml", "poses.csv"),
        ("cable", "poses", "robot.yaml", "-n", "10"),
        ("cable", "require", "robot.yaml", "poses.csv"),
        ("export", "robot.yaml", "--format", "mjcf", "-o", "robot.xml"),
    ],
    ids=lambda words: " ".join(words[:2]),
)
def test_verbs_that_take_straight_cables_name_the_one_that_is_not(place, words):
    Path("robot.yaml").write_text(PLANAR.replace("every_cable: {", "every_cable: {elasticity: 1e-5, "))
    Path("poses.csv").write_text("x [m],y [m],z [m]\n0.2,0,1.3\n-0.3,0,1.0\n0.5,0,1.2\n0.1,0,1.8\n")
    ran = robocal(*words)
    ran.assert_refused("M2", "a cable is a sum of segments", "M2 = m + 2 k")
    assert sorted(p.name for p in Path().iterdir()) == ["poses.csv", "robot.yaml"]


def test_a_workspace_of_sums_is_computed(place):
    Path("robot.yaml").write_text(PLANAR)
    ran = robocal("cable", "workspace", "robot.yaml", "--cells", "9", "-o", "there")
    assert ran.status == 0 and "held" in ran.said, ran.said
    Path("poses.csv").write_text("x [m],y [m],z [m]\n0.2,0,1.3\n-0.3,0,1.0\n")
    ran = robocal("cable", "tension", "robot.yaml", "poses.csv", "-o", "held")
    assert ran.status == 0 and "2 of 2 poses are held" in ran.said, ran.said
    page = Path("held/report.html").read_text()
    assert "M2 k" in page


# obeys: carriages-not-read
def test_carriages_that_moved_and_that_nobody_wrote_down_are_named(place):
    """Half of the poses with the carriages elsewhere: zeros look reset, and the first reason is the rails."""
    text = (EXAMPLES / "cable-kinds" / "rails.yaml").read_text().partition("calibrate:")[0]
    Path("robot.yaml").write_text(f"{text}calibrate: {{free: [ax, ay, az, l0]}}\n")
    robot, rng, n = read_cable("robot.yaml").robot, np.random.default_rng(4), 24
    railed = [c for c in robot.cables if f"{c}.carriage" in robot.table]
    pose = se3.from_vector(np.c_[rng.uniform(-0.5, 0.5, (n, 3)) + robot.home[:3, 3], rng.normal(0, 0.1, (n, 3))])
    stood = np.where(np.arange(n)[:, None] < n // 2, 0.2, 0.2 + rng.uniform(0.0, 0.4, (n, len(railed))))
    there = [
        robot.with_values({f"{c}.carriage": s for c, s in zip(railed, row, strict=True)}) for row in stood.tolist()
    ]
    shown = np.concatenate([inverse(r, t[None])[0] for r, t in zip(there, pose, strict=True)])
    shown += rng.normal(0, 2e-4, shown.shape)
    seen = se3.to_vector(pose) + rng.normal(0, 1e-4, (n, 6))
    titles = [[f"{c} [m]" for c in robot.cables], [f"rail_{c} [m]" for c in railed]]
    _table("lengths.csv", [*titles[0], *titles[1]], np.c_[shown, stood])
    _table("poses.csv", ["x [m]", "y [m]", "z [m]", "rx [rad]", "ry [rad]", "rz [rad]"], seen)
    head = "robocal: 1\nconfiguration: {id: id}\n"
    cables = (
        f"kind: lengths\nfile: lengths.csv\nlengths: {{columns: [{', '.join(robot.cables)}], sigma: 2.0e-4, unit: m}}\n"
    )
    turned = "orientation: {columns: [rx, ry, rz], form: rotation_vector, sigma: 1.0e-4, unit: rad}\n"
    read = "kind: pose\nfile: poses.csv\nposition: {columns: [x, y, z], sigma: 1.0e-4, unit: m}\n" + turned
    Path("lengths.yaml").write_text(head + cables)
    Path("poses.yaml").write_text(head + read)
    first = robocal("identify", "robot.yaml", "lengths.yaml", "poses.yaml", "--json")
    (said, *_) = first.document["verdict"]["remarks"]
    assert first.status == 3 and said["code"] == "carriages-not-read", first.document["verdict"]
    assert ", ".join(railed) in said["sentence"] and "carriage: {columns" in said["advice"]
    line = (
        f"carriage: {{columns: [{', '.join(f'rail_{c}' for c in railed)}], cables: [{', '.join(railed)}], unit: m}}\n"
    )
    Path("lengths.yaml").write_text(head + cables + line)
    then = robocal("identify", "robot.yaml", "lengths.yaml", "poses.yaml", "--json").document
    assert "carriages-not-read" not in {r["code"] for r in (*then["verdict"]["remarks"], *then["remarks"])}
    assert then["verdict"]["status"] != "refused"


def _table(file, titles, rows):
    with Path(file).open("w", newline="") as out:
        csv.writer(out).writerows([["id", *titles], *([f"p{i}", *row] for i, row in enumerate(rows.tolist()))])
