"""A stranger's wrong file beside a cable robot: each mistake is named, before it becomes a result."""

from __future__ import annotations

import csv
import json
import shutil

import numpy as np
import pytest
from cables.cable_robots import published
from cli.runs import robocal
from cli.test_cable_identify import LENGTHS, POSES, table
from listings import rows_of

from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import distribute
from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.write import describe_cable
from robocal.geometry import se3

LOAD = """robocal: 1
kind: load
file: load.csv
load: {columns: [t1, t2, t3, t4, t5, t6, t7, t8], unit: N, sigma: 0.5}
free: [mass, cx, cy, cz]
configuration: {id: id}
"""
ALL = ("lengths.yaml", "poses.yaml", "load.yaml")


@pytest.fixture(scope="module")
def right(tmp_path_factory):
    """Lengths to 0.3 mm, poses to 0.2 mm and 0.2 mrad, and load cells to 0.5 N, of a robot 10 mm off and 4 % heavier than drawn."""
    folder = tmp_path_factory.mktemp("right")
    robot, rng, n = published("laval"), np.random.default_rng(2), 60
    truth = robot.with_values(
        {k: robot.table[k].value + rng.normal(0, 0.01) for k in robot.table.names if ".a" in k or ".l0" in k}
    )
    drawn = np.concatenate([rng.uniform(-0.7, 0.7, (600, 3)), rng.uniform(-0.2, 0.2, (600, 3))], axis=1)
    t = se3.from_vector(drawn + np.r_[robot.a.mean(axis=0), 0, 0, 0])
    mass = 1.04 * robot.mass
    found = distribute(structure_of(truth, t), gravity_wrench(t, mass, robot.com), robot.limits, "mid")
    t, pull = t[found.has_solution][:n], found.tension[found.has_solution][:n]
    y = np.linalg.norm(t[:, None, :3, 3] + truth.b @ t[:, :3, :3].swapaxes(1, 2) - truth.a, axis=2) - truth.zeros
    ids = [f"p{i}" for i in range(n)]
    (folder / "robot.yaml").write_text(
        describe_cable(robot.having(elasticity=None)) + "calibrate: {free: [ax, ay, az, l0]}\n"
    )
    (folder / "lengths.csv").write_text(
        table([f"{c} [mm]" for c in robot.cables], ids, 1e3 * (y + 3e-4 * rng.normal(size=y.shape)))
    )
    names = ["x [mm]", "y [mm]", "z [mm]", "rx [rad]", "ry [rad]", "rz [rad]"]
    seen = se3.to_vector(t) + 2e-4 * rng.normal(size=(n, 6))
    (folder / "poses.csv").write_text(table(names, ids, seen * np.repeat([1e3, 1.0], 3)))
    (folder / "load.csv").write_text(
        table([f"t{i + 1}" for i in range(8)], ids, pull + 0.5 * rng.normal(size=pull.shape))
    )
    (folder / "lengths.yaml").write_text(
        LENGTHS.replace("COLUMNS", ", ".join(robot.cables)).replace("sigma: 1", "sigma: 0.3")
    )
    (folder / "poses.yaml").write_text(POSES.replace("free: true", "free: false"))
    (folder / "load.yaml").write_text(LOAD)
    return folder, mass


@pytest.fixture
def cell(right, tmp_path):
    shutil.copytree(right[0], tmp_path / "cell")
    return tmp_path / "cell"


def changed(place, change):
    """A CSV with the numbers of its rows changed, its ids as they were."""
    rows = list(csv.reader(place.read_text().splitlines()))
    numbers = change(np.array([[float(v) for v in r[1:]] for r in rows[1:]]))
    lines = [[r[0], *(f"{v:.9g}" for v in row)] for r, row in zip(rows[1:], numbers, strict=True)]
    place.write_text("\n".join(",".join(r) for r in [rows[0], *lines]) + "\n")


def identified(cell, *words, files=ALL):
    return robocal("identify", cell / "robot.yaml", *(cell / f for f in files), *words)


def test_the_right_files_improve_and_the_weight_is_written(right, cell):
    ran = identified(cell, "-o", cell / "run")
    assert ran.status == 0, ran.said
    again = read_cable(cell / "run" / "calibrated.yaml").robot
    assert abs(again.mass / right[1] - 1) < 0.02 and again.mass != read_cable(cell / "robot.yaml").robot.mass


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t / 9.80665, "kgf for N"),
        (lambda t: t / 4.4482216, "lbf for N"),
        (lambda t: 0 * t, "another mass than that of the platform"),
        (lambda t: 0 * t + 50, "these tensions cannot hold a platform at rest"),
        (lambda t: t[:, ::-1], "these tensions cannot hold a platform at rest"),
        (lambda t: np.roll(t, 1, axis=0), "the tensions stand 1 row too low"),
        (lambda t: t[:, [1, 0, *range(2, 8)]], "the tensions of c1 and c2 are exchanged"),
    ],
)
def test_load_cells_that_hold_no_such_platform(cell, change, words):
    changed(cell / "load.csv", change)
    ran = identified(cell, "-o", cell / "run")
    assert ran.status == 2 and words in ran.said and "load.csv" in ran.said, ran.said
    assert not (cell / "run").exists()


def test_load_cells_alone_tell_no_anchor(cell):
    ran = identified(cell, files=("poses.yaml", "load.yaml"))
    assert ran.status == 2 and "load cells without lengths" in ran.said


def flipped(*axes):
    return lambda v: v * [-1 if i in axes else 1 for i in range(6)]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (flipped(0), "in the positions x has the wrong sign"),
        (lambda v: v[:, [1, 0, 2, 3, 4, 5]], "in the positions x and y are exchanged"),
        (flipped(1, 3, 5), "left-handed frame"),
        (flipped(3, 4, 5), "the orientations are inverted"),
        (lambda v: v * np.repeat([1.0, 180 / np.pi * 9], 3), "more than a whole turn"),
    ],
)
def test_poses_in_other_axes(cell, change, words):
    changed(cell / "poses.csv", change)
    ran = identified(cell, files=ALL[:2])
    assert ran.status == 2 and words in ran.said and "poses" in ran.said, ran.said


def test_rows_that_were_copied(cell):
    for name in ("lengths.csv", "poses.csv"):
        first, *rows = (cell / name).read_text().splitlines()
        (cell / name).write_text("\n".join([first, *rows, *("again" + r for r in rows[:20])]) + "\n")
    ran = identified(cell, files=ALL[:2])
    assert ran.status == 2 and "repeat others to the last digit" in ran.said and "20 of 80" in ran.said


def test_a_drum_that_nobody_makes(cell):
    changed(cell / "lengths.csv", lambda y: (y + 2000) / 2)
    (cell / "lengths.yaml").write_text((cell / "lengths.yaml").read_text() + "gain: {name: drums}\n")
    ran = identified(cell, "--json", files=ALL[:2])
    said = json.loads(ran.out)["verdict"]
    assert ran.status == 3 and said["status"] == "refused" and "drums.gain" in said["reasons"][0]


@pytest.mark.parametrize("alone", [False, True])
def test_gains_and_zeros_of_a_file_of_lengths_are_the_robots_afterwards(cell, alone):
    """Sensors that show 3 permille too little and count from elsewhere: forward with the run is right, and so is its file by itself."""
    changed(cell / "lengths.csv", lambda y: y / 1.003 + 40)
    text = (cell / "lengths.yaml").read_text()
    (cell / "lengths.yaml").write_text(text + "gain: {name: drums}\nzeros: evening\n")
    ran = identified(cell, "-o", cell / "run", files=ALL[:2])
    assert ran.status == 0 and "cannot hold" not in ran.said and "drums.gain" in ran.said, ran.said
    shutil.copy(cell / "run" / "calibrated.yaml", cell / "alone.yaml")
    ids = [f"p{i}" for i in range(5)]
    lines = (cell / "lengths.csv").read_text().splitlines()[:6]
    (cell / "few.csv").write_text("\n".join(lines) + "\n")
    robot = cell / ("alone.yaml" if alone else "run")
    ran = robocal("cable", "forward", robot, cell / "few.csv", "--sigma", "0.0003", "--json")
    assert ran.status == 0 and ("evening" in ran.said) is not alone, ran.said
    found = {p["id"]: p for p in rows_of(json.loads(ran.out)["poses"])}
    seen = {
        r[0]: [float(v) for v in r[1:]] for r in list(csv.reader((cell / "poses.csv").read_text().splitlines()))[1:]
    }
    for name in ids:
        off = np.array(found[name]["T_base_platform"])[:3, 3] - np.array(seen[name][:3]) / 1e3
        assert np.linalg.norm(off) < 4 * np.hypot(found[name]["sigma_position"], 2e-4)


def test_forward_says_what_became_of_its_run(cell):
    changed(cell / "lengths.csv", lambda y: (y + 2000) / 2)
    (cell / "lengths.yaml").write_text((cell / "lengths.yaml").read_text() + "gain: {name: drums}\n")
    assert identified(cell, "-o", cell / "run", files=ALL[:2]).status == 3
    ran = robocal("cable", "forward", cell / "run", cell / "lengths.csv")
    assert ran.status == 3 and "refused" in ran.said


def test_an_output_is_no_input(cell):
    before = (cell / "lengths.csv").read_bytes()
    ran = robocal("cable", "forward", cell / "robot.yaml", cell / "lengths.csv", "-o", cell / "lengths.csv", "--force")
    assert ran.status == 2 and "one of the inputs" in ran.said and (cell / "lengths.csv").read_bytes() == before


def test_a_word_where_a_mapping_or_a_word_may_stand(cell):
    (cell / "lengths.yaml").write_text((cell / "lengths.yaml").read_text() + "tension: compute\n")
    ran = identified(cell, files=ALL[:2])
    assert ran.status == 2 and "key tension" in ran.said and "Model" not in ran.said and "computed" in ran.said


def test_require_says_what_a_plane_leaves_open(cell):
    rng = np.random.default_rng(0)
    rows = np.column_stack([rng.uniform(-700, 700, (40, 2)), np.full(40, 1900.0), np.zeros((40, 3))])
    (cell / "plane.csv").write_text(
        table(["x [mm]", "y [mm]", "z [mm]", "rx [deg]", "ry [deg]", "rz [deg]"], [f"p{i}" for i in range(40)], rows)
    )
    noise = ("--sigma", "3mm", "--sigma-position", "1mm", "--sigma-orientation", "0.1deg")
    ran = robocal("cable", "require", cell / "robot.yaml", cell / "plane.csv", *noise)
    assert "stay in a plane: a frame anchor and its mirror image fit equally well" in ran.said
    text = (cell / "plane.csv").read_text().replace("[mm]", "[m]")
    (cell / "plane.csv").write_text(text)
    assert "Check the unit" in robocal("cable", "require", cell / "robot.yaml", cell / "plane.csv", *noise).said
