"""Drums that wind up more or less than their sensors show: found beside a camera, and what cannot be told from the size of the frame."""

from __future__ import annotations

import json

import numpy as np
import pytest
from cables.cable_robots import published
from cables.precise import measured
from cli.runs import robocal
from cli.test_cable_identify import LENGTHS, POSES, table

from robocal.files.cable.write import describe_cable

UNIT = {"mm": 1e-3, "m": 1.0, "1": 1.0, "": 1.0}


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    """Every drum a per cent or so off."""
    folder = tmp_path_factory.mktemp("drums")
    robot = published("laval")
    rng = np.random.default_rng(9)
    nominal = robot.with_values(
        {n: robot.table[n].value + 0.01 * rng.normal() for n in robot.table.names if ".b" not in n}
    )
    gain = 1 + 0.01 * rng.normal(size=8)
    text = describe_cable(nominal)
    (folder / "robot.yaml").write_text(text + "calibrate: {free: [ax, ay, az, l0]}\n")
    (folder / "loose.yaml").write_text(text + "calibrate: {free: [ax, ay, az, bx, by, bz, l0]}\n")
    length, pose = measured(robot, rng, 80).observations
    ids = [f"p{i}" for i in range(80)]
    header = [f"{c} [mm]" for c in robot.cables]
    (folder / "lengths.csv").write_text(table(header, ids, 1e3 * length.value.reshape(-1, 8) / gain))
    (folder / "alike.csv").write_text(table(header, ids, 1e3 * length.value.reshape(-1, 8) / 1.01))
    names = ["x [mm]", "y [mm]", "z [mm]", "rx [rad]", "ry [rad]", "rz [rad]"]
    (folder / "poses.csv").write_text(table(names, ids, pose.value * np.repeat([1e3, 1.0], 3)))
    said = LENGTHS.replace("COLUMNS", ", ".join(robot.cables)).replace("sigma: 1", "sigma: 0.5")
    for name, file, more in (
        ("each", "lengths.csv", "gain: {name: drums, each: true}\n"), ("none", "lengths.csv", ""),
        ("alike", "alike.csv", "gain: {name: drums}\n"), ("zero", "lengths.csv", "gain: {name: drums, value: 0}\n"),
    ):  # fmt: skip
        (folder / f"{name}.yaml").write_text(said.replace("lengths.csv", file) + more)
    (folder / "poses.yaml").write_text(
        POSES.replace("sigma: 0.0002", "sigma: 0.00035").replace("free: true", "free: false")
    )
    return folder, robot, gain


def called(folder, *files, robot="robot.yaml"):
    return robocal("identify", folder / robot, *(folder / f for f in files), "--json")


def test_every_drum_is_found(cell):
    folder, robot, gain = cell
    ran = called(folder, "each.yaml", "poses.yaml")
    assert ran.status == 0, ran.remarks
    found = {p["name"]: p for p in json.loads(ran.out)["parameters"]}
    for i, cable in enumerate(robot.cables):
        p = found[f"drums.{cable}.gain"]
        assert p["status"] == "identified" and abs(p["identified"] - gain[i]) < 4.5 * p["sigma"] < 0.01
        for s, truth in zip("xyz", robot.a[i], strict=True):
            q = found[f"{cable}.a{s}"]
            assert abs(q["identified"] * UNIT[q["unit"]] - truth) < 4.5 * q["sigma"] * UNIT[q["unit"]]


def test_one_gain_of_all_drums(cell):
    folder, _, _ = cell
    ran = called(folder, "alike.yaml", "poses.yaml")
    assert ran.status == 0, ran.remarks
    (p,) = [p for p in json.loads(ran.out)["parameters"] if p["name"] == "drums.gain"]
    assert abs(p["identified"] - 1.01) < 4.5 * p["sigma"] < 0.005


def test_lengths_alone_do_not_tell_the_drums_from_the_size_of_everything(cell):
    """All lengths, the frame and the platform may be a per cent larger together: the gain is named, and stays where it was."""
    folder, _, _ = cell
    ran = called(folder, "alike.yaml", robot="loose.yaml")
    found = json.loads(ran.out)
    (p,) = [p for p in found["parameters"] if p["name"] == "drums.gain"]
    assert p["status"] != "identified"
    assert "only a combination with" in p["note"], p


def test_a_gain_is_above_zero(cell):
    folder, _, _ = cell
    ran = called(folder, "zero.yaml", "poses.yaml")
    assert ran.status == 2 and "gain.value" in ran.remarks
