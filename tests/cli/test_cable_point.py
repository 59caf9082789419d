"""A point on five cables (degrees: 3T) through every cable command, and identified from lengths and measured places."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from cli.runs import robocal
from listings import rows_of

from robocal.cables.cable_lengths import inverse
from robocal.cables.geometry import cable_robot
from robocal.geometry import se3

ANCHORS = np.array([(2.0, 2, 3), (-2, 2, 3), (-2, -2, 3), (2, -2, 3), (0, 0, 0)])
ROBOT = f"""robocal: 1
name: point
kind: cable
units: {{length: m, angle: deg}}
degrees: 3T
frame_anchors: {ANCHORS.tolist()}
platform_anchors: {np.zeros((5, 3)).tolist()}
every_cable: {{tension: [1, 100], diameter: 0.002}}
platform: {{mass: 2}}
calibrate: {{free: [ax, ay, az, l0]}}
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "robot.yaml").write_text(ROBOT)
    return tmp_path


def write(path, names, rows):
    lines = [",".join(("id", *names)), *(f"v{i}," + ",".join(f"{v:.7f}" for v in row) for i, row in enumerate(rows, 1))]
    path.write_text("\n".join(lines) + "\n")
    return path


def numbers(path, names):
    table = list(csv.DictReader(path.read_text().splitlines()))
    return np.array([[float(row[n]) for n in names] for row in table])


PLACE = ("x [m]", "y [m]", "z [m]")


def test_every_command_knows_it(folder):
    """From a list of places alone: no column of orientations is asked for."""
    assert "3T, 2 cables more than freedoms" in robocal("check", folder / "robot.yaml").said
    held = robocal(
        "cable", "workspace", folder / "robot.yaml", "--cells", 15, "--rays", 300, "-o", folder / "held", "--json"
    )
    assert held.status == 0 and held.document["reaches_box"] == ["z-"]
    made = robocal("cable", "poses", folder / "robot.yaml", "-n", 12, "-o", folder / "list", "--json")
    assert made.status == 0 and all(
        np.allclose(p["T_base_platform"][:3], np.eye(4)[:3], atol=5) for p in rows_of(made.document["poses"])
    )
    poses = numbers(folder / "list" / "poses.csv", (*PLACE, "rx [deg]", "ry [deg]", "rz [deg]"))
    assert not poses[:, 3:].any() and (np.ptp(poses[:, :3], axis=0) > 0.5).all()
    places = write(folder / "places.csv", PLACE, poses[:, :3])
    tense = robocal("cable", "tension", folder / "robot.yaml", places, "-o", folder / "tense", "--json")
    assert tense.status == 0 and all(f"wrench.f{a}" in rows_of(tense.document["poses"])[0] for a in "xyz")
    assert robocal("cable", "inverse", folder / "robot.yaml", places, "-o", folder / "lengths.csv").status == 0
    assert (
        robocal("cable", "forward", folder / "robot.yaml", folder / "lengths.csv", "-o", folder / "again.csv").status
        == 0
    )
    np.testing.assert_allclose(numbers(folder / "again.csv", PLACE), poses[:, :3], atol=1e-6)
    way = robocal("cable", "contact", folder / "robot.yaml", places, "-o", folder / "way")
    assert way.status in (0, 3) and (folder / "way" / "report.html").exists()
    need = robocal("cable", "require", folder / "robot.yaml", places, "--json")
    assert need.status == 0
    chosen = robocal("cable", "poses", folder / "robot.yaml", "-n", 40, "--choose", 10, "--json")
    assert chosen.status == 0


@pytest.mark.parametrize(
    ("verb", "option", "words"),
    [
        ("workspace", ("--tilt", "5"), "cannot tilt"),
        ("workspace", ("--orientation", "0,0,5"), "it is 3T"),
        ("poses", ("--turn", "5"), "does not turn"),
    ],
)
def test_what_turns_it_is_refused(folder, verb, option, words):
    ran = robocal("cable", verb, folder / "robot.yaml", *option)
    assert ran.status == 2 and words in ran.remarks


def test_it_has_no_orientation_to_measure(folder, rng):
    places = write(folder / "places.csv", PLACE, rng.uniform(0.5, 1.5, (9, 3)))
    ran = robocal("cable", "require", folder / "robot.yaml", places, "--sigma-orientation", "1deg")
    assert ran.status == 2 and "--sigma-orientation" in ran.remarks and "does not turn" in ran.remarks


def test_a_platform_of_one_point_is_told_that_it_is_one(folder):
    (folder / "robot.yaml").write_text(ROBOT.replace("degrees: 3T\n", ""))
    ran = robocal("check", folder / "robot.yaml")
    assert ran.status == 2 and "is 3T" in ran.remarks


def test_it_is_identified_from_places(folder, rng):
    """Anchors 30 mm off, an instrument that counts from the base: the anchors are found to four of their own standard deviations."""
    truth, zeros = ANCHORS + rng.normal(0, 0.03, (5, 3)), rng.normal(0, 0.03, 5)
    robot, n = cable_robot("truth", truth, np.zeros((5, 3)), zeros, degrees="3T"), 40
    places = np.column_stack([rng.uniform(-1.2, 1.2, (n, 2)), rng.uniform(0.4, 2.4, n)])
    read = inverse(robot, se3.compose(np.eye(3), places))[0] + rng.normal(0, 5e-4, (n, 5))
    write(folder / "lengths.csv", [f"c{i} [m]" for i in range(1, 6)], read)
    write(folder / "points.csv", PLACE, places + rng.normal(0, 5e-4, (n, 3)))
    (folder / "points.yaml").write_text(
        "robocal: 1\nkind: position\nfile: points.csv\nposition: {columns: [x, y, z], sigma: 0.0005}\nframe: {name: tracker, free: false}\nconfiguration: {id: id}\n"
    )
    ran = robocal(
        "identify",
        folder / "robot.yaml",
        folder / "lengths.csv",
        folder / "points.yaml",
        "-o",
        folder / "run",
        "--json",
    )
    assert ran.status == 0, ran.said
    found = {p["name"]: p for p in ran.document["parameters"]}
    for i, row in enumerate(np.column_stack([truth, zeros]), 1):
        for symbol, value in zip(("ax", "ay", "az", "l0"), row, strict=True):
            p = found[f"c{i}.{symbol}"]
            assert p["status"] == "identified", p
            assert abs(p["identified"] - value) < 4 * p["sigma"] < 0.05, p
    # A file without a list of cables gets one for the zeros: by itself it is the identified robot, and the run reads its own lengths.
    assert "cannot hold" not in ran.said
    for place in ("run", "run/calibrated.yaml"):
        again = robocal(
            "cable",
            "forward",
            folder / place,
            folder / "lengths.csv",
            "--sigma",
            "0.0005",
            "-o",
            folder / "again.csv",
            "--force",
        )
        assert again.status == 0, again.said
        assert np.abs(numbers(folder / "again.csv", PLACE) - places).max() < 5e-3
