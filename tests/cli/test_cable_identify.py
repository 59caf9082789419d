"""robocal identify and check of a cable robot: lengths beside poses, tied by the ids of their rows."""

from __future__ import annotations

import json

import numpy as np
import pytest
from cables.cable_robots import box
from cli.runs import robocal

from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.write import describe_cable
from robocal.files.runfolder import read_residuals
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations

POSES = """robocal: 1
kind: pose
file: poses.csv
position: {columns: [x, y, z], sigma: 0.2}
orientation: {columns: [rx, ry, rz], form: rotation_vector, sigma: 0.0002}
frame: {name: tracker, free: true}
configuration: {id: id}
"""
LENGTHS = """robocal: 1
kind: lengths
file: lengths.csv
lengths: {columns: [COLUMNS], sigma: 1}
configuration: {id: id}
"""


def table(names, ids, rows):
    return (
        "\n".join(
            [
                ",".join(["id", *names]),
                *(",".join([i, *(f"{v:.9g}" for v in row)]) for i, row in zip(ids, rows, strict=True)),
            ]
        )
        + "\n"
    )


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    """A cable robot whose anchors are centimetres off, and what its sensors and a tracker that stands anywhere have read."""
    folder = tmp_path_factory.mktemp("cell")
    text = describe_cable(box()) + "calibrate: {free: [ax, ay, az, l0]}\n"
    (folder / "robot.yaml").write_text(text)
    robot = read_cable(folder / "robot.yaml").robot
    rng, m, n = np.random.default_rng(4), 60, len(robot.cables)
    truth = robot.with_values({x: robot.table[x].value + rng.normal(0, 0.015) for x in robot.table.free})
    low, high = robot.a.min(axis=0), robot.a.max(axis=0)
    start = np.concatenate(
        [(low + high) / 2 + 0.25 * rng.uniform(-1, 1, (m, 3)) * (high - low), rng.normal(0, 0.1, (m, 3))], axis=1
    )
    tracker = Frame("tracker", (1, 2, 0.3, 0.1, 0.2, 1.0), (True,) * 6)
    seen = Observations("pose", np.arange(m), np.zeros((m, 6)), np.full((m, 6), 2e-4), tracker)
    cables = {"cable": np.tile(np.arange(n), m)}
    read = Observations(
        "lengths", np.repeat(np.arange(m), n), np.zeros((m * n, 1)), np.full((m * n, 1), 1e-3), extra=cables
    )
    ids = tuple(f"p{i}" for i in range(m))
    pose, length = synthesise(truth, DataSet(Configurations(ids, start=start), (seen, read)), rng).observations
    names = ["x [mm]", "y [mm]", "z [mm]", "rx [rad]", "ry [rad]", "rz [rad]"]
    (folder / "poses.csv").write_text(table(names, ids, pose.value * np.repeat([1e3, 1.0], 3)))
    rows = 1e3 * length.value.reshape(m, n)
    (folder / "lengths.csv").write_text(table([f"{c} [mm]" for c in robot.cables], ids, rows))
    other = rng.permutation(n)
    (folder / "turned.csv").write_text(table([f"{robot.cables[i]} [mm]" for i in other], ids, rows[:, other]))
    (folder / "poses.yaml").write_text(POSES)
    (folder / "lengths.yaml").write_text(LENGTHS.replace("COLUMNS", ", ".join(robot.cables)))
    turned = LENGTHS.replace("COLUMNS", ", ".join(robot.cables[i] for i in other)).replace("lengths.csv", "turned.csv")
    (folder / "turned.yaml").write_text(turned)
    return folder, truth


@pytest.fixture(scope="module")
def run(cell):
    folder, _ = cell
    ran = robocal(
        "identify",
        folder / "robot.yaml",
        folder / "lengths.yaml",
        folder / "poses.yaml",
        "-o",
        folder / "run",
        "--json",
    )
    assert ran.status == 0, ran.remarks
    return json.loads(ran.out)


def test_a_cable_robot_is_identified_end_to_end(cell, run):
    folder, truth = cell
    assert run["verdict"]["status"] == "improved" and run["robot"]["convention"] == "cable 3R3T"
    held = run["residuals"]["held_out"]
    assert held["profiled"] and held["mean"] < 0.2 * run["residuals"]["held_out_before"]["mean"]
    assert {p.name for p in (folder / "run").iterdir()} == {
        "result.json", "calibrated.yaml", "covariance.json", "residuals.csv", "report.html",
    }  # fmt: skip
    calibrated = read_cable(folder / "run" / "calibrated.yaml").robot
    by_name = {p["name"]: p for p in run["parameters"]}
    unit = {"mm": 1e-3, "m": 1.0}[by_name["c1.l0"]["unit"]]
    for name in truth.table.free:
        assert by_name[name]["identified"] * unit == pytest.approx(calibrated.table[name].value, abs=1e-9)
    # Sensors' zeros do not depend on where the base is said to be.
    zeros = [n for n in truth.table.free if n.endswith(".l0")]
    for n in zeros:
        assert abs(by_name[n]["identified"] * unit - truth.table[n].value) < 4.5 * by_name[n]["sigma"] * unit


def test_held_out_rows_of_the_table_are_those_of_the_result(cell, run):
    """Profiled errors are enlarged in both, of positions and lengths as of orientations."""
    rows = read_residuals(cell[0] / "run" / "residuals.csv")
    for found, column in ((run["residuals"], "held_out_mm"), (run["residuals"]["angle"], "angle_held_out_deg")):
        held = [v for v, s in zip(rows[column], rows["set"], strict=True) if s == "held_out" and v is not None]
        assert len(held) == found["held_out"]["n"] and found["held_out"]["profiled"]
        assert np.mean(held) == pytest.approx(found["held_out"]["mean"], rel=1e-6), column
        assert max(held) == pytest.approx(found["held_out"]["max"], rel=1e-6), column


def test_columns_are_told_by_their_names(cell, run):
    folder, _ = cell
    ran = robocal("identify", folder / "robot.yaml", folder / "turned.yaml", folder / "poses.yaml", "--json")
    again = json.loads(ran.out)
    assert again["residuals"]["held_out"]["mean"] == pytest.approx(run["residuals"]["held_out"]["mean"], rel=1e-6)


def test_check_speaks_of_cables(cell):
    folder, _ = cell
    ran = robocal("check", folder / "robot.yaml", folder / "lengths.csv", folder / "poses.yaml")
    assert ran.status == 0 and "8 cables: c1" in ran.out and "joint" not in ran.out


def test_a_run_is_a_robot_again(cell, run):
    folder, _ = cell
    ran = robocal("check", folder / "run", folder / "lengths.yaml", folder / "poses.yaml", "--json")
    assert ran.status == 0
    assert json.loads(ran.out)["baseline_error"]["mean"] < 0.2 * run["residuals"]["before"]["mean"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("configuration: {id: id}", ""), "no configuration in common"),
        (("c8", "c7"), "named twice"),
        (("[c1, c2", "[c1"), "not the cables of the robot"),
        (("kind: lengths", "kind: length"), "unknown kind"),
    ],
)
def test_what_cannot_be_meant_is_refused(cell, tmp_path, change, words):
    folder, _ = cell
    wrong = folder / "wrong.yaml"
    wrong.write_text((folder / "lengths.yaml").read_text().replace(*change))
    ran = robocal("identify", folder / "robot.yaml", wrong, folder / "poses.yaml", "-o", tmp_path / "run")
    assert ran.status == 2 and words in ran.remarks and not (tmp_path / "run").exists()


def test_what_only_arms_have_is_refused(cell):
    folder, _ = cell
    ran = robocal("identify", folder / "robot.yaml", folder / "lengths.yaml", folder / "poses.yaml", "--layer")
    assert ran.status == 2 and "--layer" in ran.remarks


def test_lengths_in_each_others_columns_are_named(cell, tmp_path):
    folder, _ = cell
    for there in ("robot.yaml", "lengths.yaml", "poses.yaml", "poses.csv"):
        (tmp_path / there).write_text((folder / there).read_text())
    head, rows = rows_of(folder / "lengths.csv")
    (tmp_path / "lengths.csv").write_text(
        "\n".join([head, *(",".join([r[0], r[2], r[1], *r[3:]]) for r in rows)]) + "\n"
    )
    ran = robocal(
        "identify", tmp_path / "robot.yaml", tmp_path / "lengths.yaml", tmp_path / "poses.yaml", "-o", tmp_path / "run"
    )
    text = " ".join(ran.remarks.split())
    assert ran.status == 2 and "the lengths of c1 and c2 are exchanged" in text and "the titles c2, c1, c3" in text
    assert "lengths.csv" in text and not (tmp_path / "run").exists()


def test_the_unit_that_is_wrong_is_the_one_named(cell, tmp_path):
    folder, _ = cell
    for file, key in (("lengths.csv", "lengths.unit"), ("poses.csv", "position.unit")):
        for there in ("robot.yaml", "lengths.yaml", "poses.yaml", "lengths.csv", "poses.csv"):
            text = (folder / there).read_text()
            (tmp_path / there).write_text(text.replace("[mm]", "[m]") if there == file else text)
        ran = robocal("identify", tmp_path / "robot.yaml", tmp_path / "lengths.yaml", tmp_path / "poses.yaml")
        assert ran.status == 2 and "the size of the robot" in ran.remarks and file in ran.remarks and key in ran.remarks


def rows_of(path):
    head, *rows = path.read_text().splitlines()
    return head, [row.split(",") for row in rows]


WRONG = {
    "lengths in another unit": ("lengths.csv", lambda head, rows: (head.replace("[mm]", "[m]"), rows)),
    "two cables swapped": ("lengths.csv", lambda head, rows: (head, [[r[0], r[2], r[1], *r[3:]] for r in rows])),
    "lengths of the next row": ("lengths.csv", lambda head, rows: (head, [[r[0], *n[1:]] for r, n in zip(rows, rows[1:] + rows[:1], strict=True)])),
    "a mirrored axis": ("poses.csv", lambda head, rows: (head, [[r[0], r[1], str(-float(r[2])), *r[3:]] for r in rows])),
    "positions of other rows": ("poses.csv", lambda head, rows: (head, [[r[0], *rows[(17 * i) % 60][1:4], *r[4:]] for i, r in enumerate(rows)])),
    "positions in another unit": ("poses.csv", lambda head, rows: (head.replace("[mm]", "[m]"), rows)),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", WRONG)
def test_wrong_files_never_improve_a_robot(cell, tmp_path, name):
    folder, _ = cell
    file, change = WRONG[name]
    for there in ("robot.yaml", "lengths.yaml", "poses.yaml", "lengths.csv", "poses.csv"):
        (tmp_path / there).write_text((folder / there).read_text())
    head, rows = change(*rows_of(tmp_path / file))
    (tmp_path / file).write_text("\n".join([head, *map(",".join, rows)]) + "\n")
    ran = robocal("identify", tmp_path / "robot.yaml", tmp_path / "lengths.yaml", tmp_path / "poses.yaml", "--json")
    assert ran.status in (2, 3)
    assert json.loads(ran.out).get("verdict", {}).get("status") != "improved"
