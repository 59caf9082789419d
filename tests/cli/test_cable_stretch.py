"""Cables stretch: the tensions are read beside the lengths, computed for the weight, or left out, and each is said."""

from __future__ import annotations

import json

import numpy as np
import pytest
from cables.cable_robots import published
from cli.runs import robocal
from cli.test_cable_identify import LENGTHS, POSES, table

from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import distribute
from robocal.files.cable.write import describe_cable
from robocal.geometry import se3

NOISE = 3e-4
SOFT = 4e-5  # 1/N
READ = "tension: {columns: [t1, t2, t3, t4, t5, t6, t7, t8], unit: N}\n"


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    """Anchors 10 mm off, poses that a tracker on the base measured, lengths of cables that stretch by 7 mm and more."""
    folder = tmp_path_factory.mktemp("cell")
    robot = published("laval").having(elasticity=np.full(8, SOFT))
    rng, m = np.random.default_rng(1), 80
    truth = robot.with_values({n: robot.table[n].value + rng.normal(0, 0.01) for n in robot.geometric if ".a" in n})
    turn = np.concatenate([rng.uniform(-0.7, 0.7, (600, 3)), rng.uniform(-0.2, 0.2, (600, 3))], axis=1)
    drawn = se3.from_vector(turn + np.r_[robot.a.mean(axis=0), 0, 0, 0])
    narrow = robot.limits + [[10.0, -10.0]]  # N within the limits, so that nominal anchors hold the platform too
    held = distribute(
        structure_of(truth, drawn), gravity_wrench(drawn, robot.mass, robot.com), narrow, "mid"
    ).has_solution
    pose = drawn[held][:m]
    assert len(pose) == m
    found = distribute(structure_of(truth, pose), gravity_wrench(pose, robot.mass, robot.com), robot.limits, "mid")
    full = np.linalg.norm(pose[:, None, :3, 3] + truth.b @ pose[:, :3, :3].swapaxes(1, 2) - truth.a, axis=2)
    y = full / (1 + SOFT * found.tension) - truth.zeros + NOISE * rng.normal(size=full.shape)
    ids = [f"p{i}" for i in range(m)]
    for name, made in (("robot", robot), ("stiff", robot.having(elasticity=None))):
        (folder / f"{name}.yaml").write_text(describe_cable(made) + "calibrate: {free: [ax, ay, az, l0]}\n")
    names = [f"{c} [mm]" for c in robot.cables]
    (folder / "lengths.csv").write_text(
        table([*names, *(f"t{i + 1}" for i in range(8))], ids, np.hstack([1e3 * y, found.tension]))
    )
    seen = se3.to_vector(pose) + rng.normal(size=(m, 6)) * 2e-4
    (folder / "poses.csv").write_text(
        table(["x [mm]", "y [mm]", "z [mm]", "rx [rad]", "ry [rad]", "rz [rad]"], ids, seen * np.repeat([1e3, 1.0], 3))
    )
    (folder / "poses.yaml").write_text(POSES.replace("free: true", "free: false"))
    base = LENGTHS.replace("COLUMNS", ", ".join(robot.cables)).replace("sigma: 1", f"sigma: {1e3 * NOISE}")
    for name, more in (("read", READ), ("computed", "tension: computed\n"), ("left", "")):
        (folder / f"{name}.yaml").write_text(base + more)
    return folder, truth


def called(folder, lengths, robot="robot.yaml"):
    ran = robocal("identify", folder / robot, folder / lengths, folder / "poses.yaml", "--json")
    assert ran.status in (0, 3), ran.remarks
    return json.loads(ran.out), ran.remarks


def errors(found, truth):
    """Of every component of an anchor: how far it is off, and its standard deviation, mm."""
    unit = {"m": 1e3, "mm": 1.0}
    return [(unit[p["unit"]] * p["identified"] - 1e3 * truth.table[p["name"]].value, unit[p["unit"]] * p["sigma"])
            for p in found["parameters"] if ".a" in p["name"]]  # fmt: skip


def off(found, truth):
    """Greatest error of an anchor's component, mm."""
    return max(abs(e) for e, _ in errors(found, truth))


def sure(found, truth):
    """The same in standard deviations."""
    return max(abs(e) / s for e, s in errors(found, truth))


def test_measured_tensions_take_stretch_off(cell):
    folder, truth = cell
    found, remarks = called(folder, "read.yaml")
    assert found["verdict"]["status"] == "improved" and "stretch is removed" in remarks and "measured" in remarks
    assert sure(found, truth) < 4.5


def test_computed_tensions_come_close(cell):
    """They are of the nominal anchors: a tension that is a few newtons off stretches by tenths of a millimetre."""
    folder, truth = cell
    read, computed, left = (called(folder, f"{name}.yaml") for name in ("read", "computed", "left"))
    assert "computed" in computed[1] and "stretch is not removed from the lengths" in left[1]
    a, b, c = (off(x[0], truth) for x in (read, computed, left))
    print(f"greatest error of an anchor: {a:.2f} mm measured, {b:.2f} mm computed, {c:.2f} mm left in")
    assert b < 0.5 * c and a < 0.5 * c


def test_tensions_without_elasticity_are_said_to_be_left_aside(cell):
    folder, _ = cell
    assert "tensions of the list are ignored" in called(folder, "read.yaml", "stiff.yaml")[1]


@pytest.mark.parametrize(
    ("robot", "tension", "words"),
    [
        ("robot.yaml", READ.replace("t1, ", ""), "tension.columns"),
        ("robot.yaml", "tension: {unit: N}\n", "tension.columns"),
        ("robot.yaml", READ.replace("unit: N", "unit: mm"), "unit"),
        ("robot.yaml", "tension: measured\n", "tension"),
        ("robot.yaml", READ.replace("t8", "c8"), "another quantity"),
        ("stiff.yaml", "tension: computed\n", "elasticity"),
    ],
)
def test_what_cannot_be_meant_is_refused(cell, tmp_path, robot, tension, words):
    folder, _ = cell
    wrong = folder / "wrong.yaml"
    wrong.write_text((folder / "left.yaml").read_text() + tension)
    ran = robocal("identify", folder / robot, wrong, folder / "poses.yaml", "-o", tmp_path / "run")
    assert ran.status == 2 and words in ran.remarks and not (tmp_path / "run").exists(), ran.remarks


def test_a_cable_does_not_push(cell):
    folder, _ = cell
    text = (folder / "lengths.csv").read_text().splitlines()
    cells = text[3].split(",")
    text[3] = ",".join([*cells[:9], "-" + cells[9], *cells[10:]])
    (folder / "pushed.csv").write_text("\n".join(text) + "\n")
    (folder / "pushed.yaml").write_text((folder / "read.yaml").read_text().replace("lengths.csv", "pushed.csv"))
    ran = robocal("identify", folder / "robot.yaml", folder / "pushed.yaml", folder / "poses.yaml")
    assert ran.status == 2 and "does not push" in ran.remarks and "pushed.csv, row 4" in ran.remarks
