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
    robot = {view: e["position"]["mean"] for view, e in found["sources"]["robot"].items()}
    assert robot["as measured"] > 15 and robot["aligned"] < 5 and len(found["poses"]) == 12
    assert found["sources"]["robot"]["relative to the first"]["position"]["n"] == 11
    agreed = found["agreement"]["position"]
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
        assert other["sources"]["turned"][view]["position"]["mean"] == pytest.approx(e["position"]["mean"], rel=1e-5)


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
        (("tracker.csv",), "no poses to compare with the reference"),
        (("tracker.csv", "other.csv"), "too few poses in common"),
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


def wrong(folder, change):
    rows = (folder / "robot.csv").read_text().splitlines()
    numbers = change(np.array([[float(v) for v in r.split(",")[1:]] for r in rows[1:]]))
    ids = [r.split(",")[0] for r in rows[1:]]
    lines = [",".join([i, *(f"{v:.9g}" for v in row)]) for i, row in zip(ids, numbers, strict=True)]
    (folder / "wrong.csv").write_text("\n".join([rows[0], *lines]) + "\n")
    return robocal("verify", folder / "tracker.csv", folder / "wrong.csv")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda v: v * np.repeat([1e3, 1.0], 3), "times as far as those of tracker"),
        (lambda v: v * [-1, 1, 1, 1, 1, 1], "mirror image"),
        (lambda v: v[:, [1, 0, 2, 3, 4, 5]], "mirror image"),
        (lambda v: np.roll(v, 2, axis=0), "rows are those of tracker shifted"),
        (lambda v: v * np.repeat([0.0, 1.0], 3), "its positions scatter by"),
        (lambda v: v * np.repeat([1.0, np.pi / 180], 3), "unit of its orientations"),
        (lambda v: v * np.repeat([1.0, -1.0], 3), "orientations are the inverse"),
        (lambda v: v[np.random.default_rng(0).permutation(len(v))], "not the poses of tracker"),
    ],
)
def test_a_source_that_is_of_other_poses_is_named(folder, change, words):
    ran = wrong(folder, change)
    assert ran.status == 3 and words in ran.said, ran.said


def test_a_right_source_is_not_doubted(folder):
    assert wrong(folder, lambda v: v).status == 0


def test_the_best_alignment_is_found_from_anywhere():
    """Against a general solver from many starts, of orientations that have nothing to do with each other."""
    from scipy.optimize import least_squares

    from robocal.apply.verification import align_poses

    rng = np.random.default_rng(1)
    for _ in range(5):
        p, q = (se3.from_vector(rng.normal(size=(9, 6)) * [1, 1, 1, 2, 2, 2]) for _ in range(2))

        def left(a, p=p, q=q):
            here = a @ p
            turn = so3.log(here[:, :3, :3] @ q[:, :3, :3].swapaxes(1, 2))
            return np.concatenate([here[:, :3, 3] - q[:, :3, 3], turn], axis=1).ravel()

        best = min(
            2 * least_squares(lambda x, left=left: left(se3.from_vector(x)), rng.normal(size=6)).cost for _ in range(12)
        )
        assert np.sum(left(align_poses(p, q)[1]) ** 2) <= best * 1.02


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("group,n,e_mean,e_sd\nA,10,5,1\nA,3,6,2\n", "named twice"),
        ("group,n,e_mean,e_sd\nA,10,5,1\n", "one group alone cannot be compared"),
        ("group,n,e_mean [mm],e_sd\nA,10,5,1\nB,3,6,2\n", "one of two columns has a unit"),
        ("group,n,e_mean [mm],e_sd [parsec]\nA,10,5,1\nB,3,6,2\n", "unknown unit"),
    ],
)
def test_a_summary_that_cannot_be_meant(tmp_path, text, words):
    (tmp_path / "g.csv").write_text(text)
    ran = robocal("verify", tmp_path / "g.csv", "--summary")
    assert ran.status == 2 and words in ran.remarks and "g.csv" in ran.remarks, ran.remarks


def test_units_of_a_summary_count(tmp_path):
    found = []
    for sd in ("e_sd [mm]", "e_sd [m]"):
        (tmp_path / "g.csv").write_text(f"group,n,e_mean [mm],{sd}\nA,10,5,1\nB,3,6,2\n")
        found.append(json.loads(robocal("verify", tmp_path / "g.csv", "--summary", "--json").out)["anova"]["e"]["f"])
    assert np.isclose(found[0], found[1] * 1e6)


def test_the_same_poses_twice_are_refused(folder):
    ran = robocal("verify", folder / "tracker.csv", folder / "tracker.csv")
    assert ran.status == 2 and "the same poses twice" in ran.remarks
