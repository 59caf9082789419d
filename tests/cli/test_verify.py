"""robocal verify: poses against an external instrument, from files of any form; groups by their means."""

from __future__ import annotations

import json

import numpy as np
import pytest
from cli.runs import robocal

from robocal.geometry import se3, so3


def text(ids, poses):
    v = se3.to_vector(poses)
    rows = [
        ",".join([i, *(f"{x:.9g}" for x in (*(1e3 * r[:3]), *np.degrees(r[3:])))]) for i, r in zip(ids, v, strict=True)
    ]
    return "\n".join(["id,x [mm],y [mm],z [mm],rx [deg],ry [deg],rz [deg]", *rows]) + "\n"


def shaken(t, rng, size):
    out = t.copy()
    out[:, :3, 3] += size * rng.normal(size=(len(t), 3))
    out[:, :3, :3] = so3.exp(size * rng.normal(size=(len(t), 3))) @ t[:, :3, :3]
    return out


@pytest.fixture
def folder(tmp_path):
    """A tracker, a robot that is 20 mm and 1 degree elsewhere, and a camera with the robot's own errors and some more."""
    rng = np.random.default_rng(5)
    t = se3.from_vector(np.hstack([rng.uniform(-1, 1, (12, 3)), rng.normal(0, 0.3, (12, 3))]))
    ids = [f"p{i}" for i in range(12)]
    robot = shaken(se3.from_vector([0.02, 0, 0, 0, 0, np.radians(1.0)]) @ t, rng, 2e-3)
    camera = shaken(robot, rng, 2e-4)
    for name, poses in (("tracker", t), ("robot", robot), ("camera", camera)):
        (tmp_path / f"{name}.csv").write_text(text(ids, poses))
    order = rng.permutation(12)
    q = np.roll(_quaternions(robot[order][:, :3, :3]), 0, axis=1)
    lines = [
        ",".join([ids[k], *(f"{x:.12g}" for x in (*robot[k, :3, 3], *row))]) for k, row in zip(order, q, strict=True)
    ]
    (tmp_path / "turned.csv").write_text("\n".join(["id,x,y,z,qx,qy,qz,qw", *lines]) + "\n")
    (tmp_path / "turned.yaml").write_text(
        "robocal: 1\nkind: pose\nfile: turned.csv\nposition: {columns: [x, y, z], unit: m}\n"
        "orientation: {columns: [qx, qy, qz, qw], form: quaternion_xyzw}\nconfiguration: {id: id}\n"
    )
    return tmp_path


def _quaternions(turn):
    w = so3.log(turn)
    angle = np.linalg.norm(w, axis=1, keepdims=True)
    return np.hstack([w / angle * np.sin(angle / 2), np.cos(angle / 2)])


def test_views_and_agreement(folder):
    ran = robocal(
        "verify", folder / "tracker.csv", folder / "robot.csv", folder / "camera.csv", "-o", folder / "out", "--json"
    )
    assert ran.status == 0, ran.remarks
    found = json.loads(ran.out)
    robot = {view: e["position_mm"]["mean"] for view, e in found["sources"]["robot"].items()}
    assert robot["as measured"] > 15 and robot["aligned"] < 5 and len(found["poses"]) == 12
    assert found["sources"]["robot"]["relative to the first"]["position_mm"]["n"] == 11
    agreed = found["agreement"]["position_mm"]
    assert agreed["apart"]["robot - camera"] < 0.2 * agreed["apart"]["robot - tracker"]
    # By the numbers alone the tracker errs: robot and camera have their errors in common.
    assert agreed["own"]["tracker"] > 2.0
    assert found["anova"]["aligned"]["position"]["chance"] > 0.05
    assert json.loads((folder / "out" / "verify.json").read_text())["sources"] == found["sources"]
    assert "Who agrees with whom" in (folder / "out" / "report.html").read_text()


def test_any_form_of_orientation_in_any_order(folder):
    one, other = (
        json.loads(robocal("verify", folder / "tracker.csv", folder / f, "--json").out)
        for f in ("robot.csv", "turned.yaml")
    )
    for view, e in one["sources"]["robot"].items():
        assert other["sources"]["turned"][view]["position_mm"]["mean"] == pytest.approx(
            e["position_mm"]["mean"], rel=1e-5
        )


def test_poses_that_are_not_in_all_are_left_out_and_said(folder):
    lines = (folder / "robot.csv").read_text().splitlines()
    (folder / "short.csv").write_text("\n".join(lines[:9]) + "\n")
    ran = robocal("verify", folder / "tracker.csv", folder / "short.csv")
    assert ran.status == 0 and "4 poses are not in all files" in ran.out and "8 poses in all files" in ran.out


def test_groups_by_their_means(folder):
    table = "group,n,pos_mean [mm],pos_sd [mm],ori_mean [deg],ori_sd [deg]\ncamera,10,25.8,7.8,1.3,0.9\nencoders,10,28.6,11.2,2.9,2.0\n"
    (folder / "groups.csv").write_text(table)
    ran = robocal("verify", folder / "groups.csv", "--summary", "--json")
    found = json.loads(ran.out)["anova"]
    assert found["pos"]["chance"] == pytest.approx(0.525, abs=1e-3) and found["ori"]["chance"] == pytest.approx(
        0.033, abs=1e-3
    )
    said = robocal("verify", folder / "groups.csv", "--summary")
    assert "not shown to differ" in said.out and said.status == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("tracker.csv",), "nothing to be compared with"),
        (("tracker.csv", "other.csv"), "no poses in common"),
        (("tracker.csv", "places.csv"), "position"),
        (("tracker.csv", "twice.csv"), "twice"),
        (("tracker.csv", "nowhere.csv"), "nowhere"),
        (("groups.csv", "--summary"), "pos_sd"),
        (("tracker.csv", "robot.csv", "--summary"), "a summary is one file"),
    ],
)
def test_what_cannot_be_compared_is_refused(folder, words, said):
    text = (folder / "robot.csv").read_text()
    (folder / "other.csv").write_text(text.replace("p", "q"))
    (folder / "places.csv").write_text("\n".join(",".join(line.split(",")[:4]) for line in text.splitlines()) + "\n")
    (folder / "twice.csv").write_text(text.replace("p2,", "p1,"))
    (folder / "groups.csv").write_text("group,n,pos_mean\na,3,1\nb,3,2\n")
    ran = robocal("verify", *((folder / w if w.endswith(".csv") else w) for w in words), "-o", folder / "out")
    assert ran.status == 2 and said in ran.remarks and not (folder / "out").exists(), ran.remarks
