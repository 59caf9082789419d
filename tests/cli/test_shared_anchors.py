"""Cables that share anchors by their file share the parameters: one number each, found once and written once."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from cables.cable_robots import published
from cables.precise import measured
from cli.runs import robocal
from cli.test_cable_identify import LENGTHS, POSES, table

from robocal.cables.geometry import cable_robot
from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.write import describe_cable

SHARED = {f"c{j}.b{s}": f"c{i}.b{s}" for i, j in ((1, 5), (2, 6)) for s in "xyz"}


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    """Eight cables, of which four end at two points of the platform; those points are unknown as well."""
    folder = tmp_path_factory.mktemp("shared")
    whole = published("laval")
    b = whole.b.copy()
    b[4], b[5] = b[0], b[1]
    truth = cable_robot(
        "shared", whole.a, b, whole.zeros, free=("ax", "ay", "az", "bx", "by", "bz", "l0"), shared=SHARED
    )
    rng = np.random.default_rng(2)
    nominal = truth.with_values({n: truth.table[n].value + 0.01 * rng.normal() for n in truth.table.names})
    (folder / "robot.yaml").write_text(describe_cable(nominal))
    names = ["x [mm]", "y [mm]", "z [mm]", "rx [rad]", "ry [rad]", "rz [rad]"]
    length, pose = measured(replace(truth), rng, 100).observations
    ids = [f"p{i}" for i in range(100)]
    (folder / "lengths.csv").write_text(
        table([f"{c} [mm]" for c in truth.cables], ids, 1e3 * length.value.reshape(-1, 8))
    )
    (folder / "poses.csv").write_text(table(names, ids, pose.value * np.repeat([1e3, 1.0], 3)))
    (folder / "lengths.yaml").write_text(
        LENGTHS.replace("COLUMNS", ", ".join(truth.cables)).replace("sigma: 1", "sigma: 0.5")
    )
    (folder / "poses.yaml").write_text(
        POSES.replace("sigma: 0.0002", "sigma: 0.00035").replace("free: true", "free: false")
    )
    return folder, truth


def test_shared_anchors_are_found_once(cell, tmp_path):
    folder, truth = cell
    ran = robocal(
        "identify",
        *(folder / f for f in ("robot.yaml", "lengths.yaml", "poses.yaml")),
        "-o",
        tmp_path / "run",
        "--json",
    )
    assert ran.status == 0, ran.remarks
    found = {p["name"]: p for p in json.loads(ran.out)["parameters"]}
    assert not set(SHARED) & set(found) and len([n for n in found if n[:2] in {f"c{i}" for i in range(1, 9)}]) == 56 - 6
    unit = {"mm": 1e-3, "m": 1.0}
    for name, p in found.items():
        if name in truth.table:
            assert (
                abs(p["identified"] * unit[p["unit"]] - truth.table[name].value) < 4.5 * p["sigma"] * unit[p["unit"]]
            ), name
    robot = read_cable(tmp_path / "run" / "calibrated.yaml").robot
    assert (robot.b[[4, 5]] == robot.b[[0, 1]]).all() and robot.shared == SHARED
    again = robocal("cable", "forward", tmp_path / "run", folder / "lengths.csv", "--json")
    assert again.status == 0, again.remarks


def test_sharing_knows_more(cell):
    """One number seen by two cables is known better than two seen by one each."""
    folder, truth = cell
    apart = cable_robot("apart", truth.a, truth.b, truth.zeros, free=("ax", "ay", "az", "bx", "by", "bz", "l0"))
    (folder / "apart.yaml").write_text(describe_cable(apart))
    sigma = []
    for robot in ("robot.yaml", "apart.yaml"):
        ran = robocal("identify", *(folder / f for f in (robot, "lengths.yaml", "poses.yaml")), "--json")
        sigma.append({p["name"]: p["sigma"] for p in json.loads(ran.out)["parameters"]}["c1.bx"])
    assert sigma[0] < sigma[1]
