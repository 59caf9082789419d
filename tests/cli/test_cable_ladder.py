"""What arms had alone: simulate, identify, validate, predict and the rest on a cable robot, through the same verbs."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
from cables.cable_robots import box
from cli.runs import robocal

from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.pose_lists import read_platform_poses
from robocal.files.cable.write import describe_cable


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The three commands of the manual: 60 poses simulated, the robot identified, and validated on 30 fresh ones."""
    folder = tmp_path_factory.mktemp("ladder")
    text = describe_cable(box()) + "calibrate: {free: [ax, ay, az, l0]}\n"
    (folder / "robot.yaml").write_text(text)
    sim = folder / "sim"
    made = robocal(
        "simulate", folder / "robot.yaml", "-n", 60, "--fresh", 30, "--frame", "none", "--seed", 3, "-o", sim
    )
    found = robocal("identify", sim / "robot.yaml", sim / "lengths.yaml", sim / "pose.yaml", "-o", sim / "run")
    judged = robocal(
        "validate", sim / "run", sim / "fresh-lengths.yaml", sim / "fresh-pose.yaml", "--against", sim / "robot.yaml",
        "-o", folder / "judged",
    )  # fmt: skip
    return folder, made, found, judged


def test_three_commands_from_a_simulated_robot_to_a_proof(run):
    folder, made, found, judged = run
    assert "SIMULATED" in (folder / "sim" / "lengths.csv").read_text().splitlines()[0]
    assert "next: robocal validate" in made.out and found.status == 0 and "IMPROVED" in found.out
    assert judged.status == 0, judged.out
    said = json.loads((folder / "judged" / "validation.json").read_text())
    assert said["trusted"] and said["errors"]["this"]["profiled"] and said["iso_9283"] == {}
    assert said["errors"]["this"]["mean"] < 0.2 * said["errors"]["against"]["mean"]
    low = said["gain"]["low"]
    assert low > 1.0  # mm
    truth = read_cable(folder / "sim" / "truth.yaml").robot
    result = json.loads((folder / "sim" / "run" / "result.json").read_text())
    known = [p for p in result["parameters"] if p["status"] == "identified" and p["name"] in truth.table]
    assert len(known) == 32
    assert all(abs(p["identified"] - truth.table[p["name"]].value) < 4.5 * p["sigma"] for p in known)


def test_fitted_poses_prove_nothing(run):
    folder, *_ = run
    sim = folder / "sim"
    again = robocal("validate", sim / "run", sim / "lengths.yaml", sim / "pose.yaml")
    assert again.status == 3 and "fitted" in again.out + again.err


def test_poses_alone_predict_nothing(run):
    folder, *_ = run
    again = robocal("validate", folder / "sim" / "run", folder / "sim" / "fresh-pose.yaml")
    assert again.status == 2 and "nothing here predicts the measured poses" in again.err and "lengths" in again.err


def rows(path):
    with path.open() as file:
        return list(csv.DictReader(file))


def test_predicted_lengths_and_poses_lie_within_their_bands(run):
    folder, *_ = run
    sim = folder / "sim"
    robocal(
        "simulate",
        sim / "truth.yaml",
        "-n",
        25,
        "--length-error",
        0,
        "--noise",
        0,
        "--frame",
        "none",
        "-o",
        folder / "true",
    )
    poses, lengths = folder / "true" / "pose.csv", folder / "true" / "lengths.csv"
    assert robocal("predict", sim / "run", poses, "-o", folder / "l.csv").status == 0
    assert robocal("predict", sim / "run", lengths, "-o", folder / "p.csv").status == 0
    cables = read_cable(sim / "robot.yaml").robot.cables
    wrong = folder / "wrong.csv"
    heads, *body = [line for line in lengths.read_text().splitlines() if not line.startswith("#")]
    wrong.write_text(
        "\n".join([heads, body[0], ",".join([body[1].split(",")[0], *(["0.1"] * heads.count("["))])]) + "\n"
    )
    doubted = robocal("predict", sim / "run", wrong)
    assert doubted.status == 3 and "the residual of its lengths is" in doubted.said, (
        "lengths that no pose explains are told"
    )
    true, said = rows_of(lengths), rows(folder / "l.csv")
    for page in (folder / "l.html", folder / "p.html"):
        assert f'max="{len(true) - 1}"' in page.read_text(), "the robot is drawn at every row"
    off = np.array([[float(s[f"{c} [mm]"]) - 1e3 * t[c] for c in cables] for s, t in zip(said, true, strict=True)])
    band = np.array([[float(s[f"{c}_band [mm]"]) for c in cables] for s in said])
    assert np.mean(np.abs(off) < band) > 0.85 and band.max() < 2.0
    there = read_platform_poses(poses, read_cable(sim / "robot.yaml").robot).values[:, :3, 3]
    found = np.array([[float(s[f"{a} [mm]"]) for a in "xyz"] for s in rows(folder / "p.csv")])
    radius = np.array([float(s["band [mm]"]) for s in rows(folder / "p.csv")])
    assert np.mean(np.linalg.norm(found - 1e3 * there, axis=1) < radius) > 0.85 and radius.max() < 5.0


def rows_of(path):
    """The lengths of a simulated table in m, by cable."""
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    names = [h.partition(" [")[0] for h in lines[0].split(",")]
    assert all(h.endswith("[m]") for h in lines[0].split(",")[1:])
    return [dict(zip(names[1:], map(float, line.split(",")[1:]), strict=True)) for line in lines[1:]]


@pytest.mark.parametrize(
    ("verb", "instead"),
    [
        (("plan",), "cable poses"),
        (("compensate", "pose.csv"), "cable inverse"),
        (("export", "--format", "dh"), "--format yaml"),
    ],
)
def test_what_a_cable_robot_lacks_is_said_in_one_sentence(run, verb, instead):
    folder, *_ = run
    sim = folder / "sim"
    given = [sim / w if w.endswith(".csv") else w for w in verb[1:]]
    said = robocal(verb[0], sim / "run", *given)
    assert said.status == 2 and "this is a cable robot, and an arm is needed" in said.err and instead in said.err


def test_a_cable_robot_is_exported_as_yaml(run):
    folder, *_ = run
    text = robocal("export", folder / "sim" / "run", "--format", "yaml").out
    assert "frame_anchors" in text and "kind: cable" in text


def test_a_robot_of_another_format_is_simulated_as_robot_yaml(tmp_path):
    from robocal.verbs.demo.cases import example_folder

    made = robocal("simulate", example_folder("cable-published") / "cogiro.yaml", "-n", 20, "-o", tmp_path / "sim")
    assert made.status == 0, made.err
    assert read_cable(tmp_path / "sim" / "robot.yaml").robot.cables
