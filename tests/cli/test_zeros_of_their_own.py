"""Sensors of cables that were set anew at a power-up: the lengths of that file count from zeros of their own."""

from __future__ import annotations

import json

import numpy as np
import pytest
from cables.cable_robots import published
from cables.precise import measured
from cli.runs import robocal
from cli.test_cable_identify import LENGTHS, POSES, table

from robocal.files.cable.write import describe_cable


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    """Two files of lengths of one robot, its sensors set anew in between: by anything up to metres."""
    folder = tmp_path_factory.mktemp("anew")
    robot = published("laval")
    rng = np.random.default_rng(8)
    nominal = robot.with_values(
        {n: robot.table[n].value + 0.01 * rng.normal() for n in robot.table.names if ".b" not in n}
    )
    (folder / "robot.yaml").write_text(describe_cable(nominal) + "calibrate: {free: [ax, ay, az, l0]}\n")
    anew = rng.uniform(-2, 2, 8)
    names = ["x [mm]", "y [mm]", "z [mm]", "rx [rad]", "ry [rad]", "rz [rad]"]
    rows = []
    for part, more in (("morning", np.zeros(8)), ("evening", anew)):
        length, pose = measured(robot, rng, 40).observations
        ids = [f"{part}{i}" for i in range(40)]
        (folder / f"{part}.csv").write_text(
            table([f"{c} [mm]" for c in robot.cables], ids, 1e3 * (length.value.reshape(-1, 8) - more))
        )
        text = LENGTHS.replace("COLUMNS", ", ".join(robot.cables)).replace("sigma: 1", "sigma: 0.5")
        (folder / f"{part}.yaml").write_text(text.replace("lengths.csv", f"{part}.csv"))
        rows.append(table(names, ids, pose.value * np.repeat([1e3, 1.0], 3)))
    (folder / "own.yaml").write_text((folder / "evening.yaml").read_text() + "zeros: evening\n")
    (folder / "poses.csv").write_text(rows[0] + rows[1].split("\n", 1)[1])
    (folder / "poses.yaml").write_text(
        POSES.replace("sigma: 0.0002", "sigma: 0.00035").replace("free: true", "free: false")
    )
    return folder, robot, anew


def called(folder, *files):
    return robocal("identify", folder / "robot.yaml", *(folder / f for f in files), folder / "poses.yaml", "--json")


def test_zeros_of_their_own_are_found(cell):
    folder, robot, anew = cell
    ran = called(folder, "morning.yaml", "own.yaml")
    assert ran.status == 0, ran.remarks
    found = {p["name"]: p for p in json.loads(ran.out)["parameters"]}
    unit = {"mm": 1e-3, "m": 1.0}
    for i, cable in enumerate(robot.cables):
        for name, truth in ((f"evening.{cable}", robot.zeros[i] + anew[i]), (f"{cable}.l0", robot.zeros[i])):
            p = found[name]
            assert p["status"] == "identified"
            assert abs(p["identified"] * unit[p["unit"]] - truth) < 4.5 * p["sigma"] * unit[p["unit"]], name


def test_without_a_word_it_is_refused(cell):
    folder, _, _ = cell
    ran = called(folder, "morning.yaml", "evening.yaml")
    assert ran.status == 3 and json.loads(ran.out)["verdict"]["status"] != "improved"


def test_anchors_are_found_with_one_power_up_alone(cell):
    folder, robot, _ = cell
    ran = called(folder, "own.yaml")
    assert ran.status == 0, ran.remarks
    found = json.loads(ran.out)
    told = {p["name"]: p["status"] for p in found["parameters"]}
    # Nothing counts from the robot's own zeros here: they stay where they were.
    assert told["evening.c1"] == "identified" and told["c1.ax"] == "identified" and told["c1.l0"] != "identified"


def test_a_name_is_a_name(cell):
    folder, _, _ = cell
    (folder / "wrong.yaml").write_text((folder / "evening.yaml").read_text() + "zeros: {name: evening}\n")
    ran = called(folder, "morning.yaml", "wrong.yaml")
    assert ran.status == 2 and "zeros" in ran.remarks
