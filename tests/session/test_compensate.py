"""Targets in files, compensated by the verb: forms of orientation, branches, tools, order, refusals."""

from __future__ import annotations

import csv
import io
import shutil
from pathlib import Path

import numpy as np
import pytest
from called import compensate
from cli.runs import Ran, files, robocal, small
from run_folders import earlier

from robocal.files import orientation
from robocal.files.display import listing_text
from robocal.files.robot import describe, open_robot
from robocal.files.targets import read_targets
from robocal.geometry import so3
from robocal.remarks.code import Code
from robocal.session.inputs import open_arm
from robocal.session.simulated_robot import sample_joints

FORMS = [
    ("rx [deg],ry [deg],rz [deg]", "rotation_vector", {}, np.degrees),
    ("qx,qy,qz,qw", "quaternion_xyzw", {}, np.asarray),
    ("a [deg],b [deg],c [deg]", "euler", {"order": "ZYX", "frame": "intrinsic"}, np.degrees),
    ("a [rad],b [rad],c [rad]", "euler", {"order": "XYZ", "frame": "extrinsic"}, np.asarray),
    ("r11,r12,r13,r21,r22,r23,r31,r32,r33", "matrix", {}, np.asarray),
]


@pytest.fixture(scope="module")
def ur10(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A nominal and a calibrated robot file, and poses that the nominal one reaches."""
    folder = tmp_path_factory.mktemp("ur10")
    rng = np.random.default_rng(5)
    nominal = open_robot("ur10").chain
    real = nominal.with_values({n: nominal.table[n].value + rng.normal(0, 1e-3) for n in nominal.geometric})
    (folder / "nominal.yaml").write_text(describe(nominal), encoding="utf-8")
    (folder / "calibrated.yaml").write_text(describe(real), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("small")
    small(folder)
    assert robocal("identify", folder / "robot.yaml", folder / "data.yaml", "-o", folder / "run").status == 0
    return folder


def table(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def numbers(rows: list[dict[str, str]], names: str) -> np.ndarray:
    return np.array([[float(r[n]) for n in names.split(",")] for r in rows])


@pytest.mark.parametrize(("header", "form", "more", "shown"), FORMS)
def test_every_form_of_orientation_goes_in_and_out(ur10: Path, tmp_path: Path, header, form, more, shown) -> None:
    nominal, real = (open_robot(ur10 / f"{n}.yaml").chain for n in ("nominal", "calibrated"))
    q = np.random.default_rng(1).uniform(0.4, 1.2, (6, 6))
    target = nominal.pose(q)
    keys = {"order": more.get("order", "XYZ"), "intrinsic": more.get("frame") != "extrinsic"}
    turn = shown(orientation.to_form(target[:, :3, :3], form, **keys))
    joints = ",".join(f"j{i} [rad]" for i in range(1, 7))
    lines = [f"x [mm],y [mm],z [mm],{header},{joints}"]
    lines += [
        ",".join(repr(float(v)) for v in (*1e3 * t[:3, 3], *o, *j)) for t, o, j in zip(target, turn, q, strict=True)
    ]
    (tmp_path / "poses.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    plain = [h.partition(" [")[0] for h in header.split(",")]
    words = "".join(f", {k}: {v}" for k, v in more.items())
    (tmp_path / "targets.yaml").write_text(
        "robocal: 1\nkind: targets\nfile: poses.csv\nposition: {columns: [x, y, z]}\n"
        f"orientation: {{columns: [{', '.join(plain)}], form: {form}{words}}}\n",
        encoding="utf-8",
    )
    read = read_targets(tmp_path / "targets.yaml", nominal).targets
    assert read.rotation is not None and np.abs(read.rotation - target[:, :3, :3]).max() < 1e-9
    found = compensate(
        str(ur10 / "calibrated.yaml"), str(tmp_path / "targets.yaml"), nominal=str(ur10 / "nominal.yaml")
    )
    rows = table(listing_text(found.listing))
    assert [r["status"] for r in rows] == ["ok"] * 6
    unit = "[rad]" if "j1 [rad]" in rows[0] else "[deg]"
    corrected = numbers(rows, ",".join(f"j{i} {unit}" for i in range(1, 7)))
    corrected = corrected if unit == "[rad]" else np.radians(corrected)
    assert np.abs(real.pose(corrected) - target).max() < 1e-7
    # The Cartesian command in the form of the targets, read again, is the nominal pose of the corrected joints.
    lines = [f"x [mm],y [mm],z [mm],{header}"]
    names = ",".join(f"tcp_{n}" for n in (*(f"{a} [mm]" for a in "xyz"), *header.split(",")))
    lines += [",".join(map(repr, row)) for row in numbers(rows, names).tolist()]
    (tmp_path / "poses.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    back = read_targets(tmp_path / "targets.yaml", nominal).targets
    want = nominal.pose(corrected)
    assert back.position is not None and back.rotation is not None
    assert np.abs(back.position - want[:, :3, 3]).max() < 1e-9
    assert np.abs(so3.log(back.rotation @ np.swapaxes(want[:, :3, :3], 1, 2))).max() < 1e-9


@pytest.mark.slow
def test_a_run_folder_knows_its_nominal_robot_and_keeps_the_order(run: Path) -> None:
    text = "id,x [mm],y [mm],z [mm]\nfar,1500,0,0\na,300,50,300\nb,250,-100,350\n"
    (run / "t.csv").write_text(text, encoding="utf-8")
    ran = robocal("compensate", run / "run", run / "t.csv", "-o", run / "out")
    assert ran.status == 0 and "1 of 3 targets cannot be reached" in ran.err and "branch" in ran.err
    assert "2 ok, 1 unreachable" in ran.out
    assert files(run / "out") == {"compensated.csv", "compensation.json", "compensation.html"}
    robocal("compensate", run / "run", run / "t.csv", "-o", run / "out").assert_refused("compensated.csv", "--force")
    assert robocal("compensate", run / "run", run / "t.csv", "-o", run / "out", "--force").status == 0
    rows = table((run / "out" / "compensated.csv").read_text(encoding="utf-8"))
    assert [(r["target"], r["status"]) for r in rows] == [("far", "unreachable"), ("a", "ok"), ("b", "ok")]
    assert rows[0]["j1 [deg]"] == rows[0]["tcp_x [mm]"] == "" and "nearest" in rows[0]["note"]
    real = open_arm(run / "run").chain
    q = np.radians(numbers(rows[1:], "j1 [deg],j2 [deg],j3 [deg]"))
    assert np.abs(1e3 * real.pose(q)[:, :3, 3] - [[300, 50, 300], [250, -100, 350]]).max() < 1e-4
    assert rows[0]["within_95 [mm]"] == "" and 0.01 < float(rows[1]["within_95 [mm]"]) < 1.0
    assert "the real robot is expected within" in ran.out
    # On stdout the same table; with --json a document.
    assert table(robocal("compensate", run / "run", run / "t.csv").out) == rows
    document = robocal("compensate", run / "run", run / "t.csv", "--json").document
    assert document["status"]["unreachable"] == 1 and document["errors"]["after"]["n"] == 2
    assert document["errors"]["before"]["mean"] > 1.0 > 1e-3 > document["errors"]["after"]["mean"]


def test_the_band_holds_the_real_robot(run: Path) -> None:
    """Driven with the corrected joint values, the true robot (which only the simulation knows) arrives within the
    stated radius, up to the base, whose place an instrument in a frame of its own does not tell."""
    truth, real = open_arm(run / "truth.yaml").chain, open_arm(run / "run").chain
    q = np.random.default_rng(2).uniform(-0.5, 0.9, (300, 3))
    lines = ["j1 [rad],j2 [rad],j3 [rad]", *(",".join(map(repr, row)) for row in q.tolist())]
    (run / "many.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    rows = [r for r in table(robocal("compensate", run / "run", run / "many.csv").out) if r["j1 [rad]"]]
    got = numbers(rows, "j1 [rad],j2 [rad],j3 [rad]")
    at, want = truth.pose(got)[:, :3, 3], real.pose(got)[:, :3, 3]
    turn, shift = rigid(at, want)
    gap = 1e3 * np.linalg.norm(at @ turn.T + shift - want, axis=1)
    inside = gap < numbers(rows, "within_95 [mm]")[:, 0]
    assert len(rows) > 250 and inside.mean() > 0.95


def rigid(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The motion that takes points a nearest to b."""
    ma, mb = a.mean(axis=0), b.mean(axis=0)
    u, _, vt = np.linalg.svd((b - mb).T @ (a - ma))
    r = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    return r, mb - r @ ma


def test_an_explicit_nominal_robot_and_the_run_say_the_same(run: Path) -> None:
    (run / "q.csv").write_text("j1 [deg],j2 [deg],j3 [deg]\n10,20,30\n-20,30,40\n", encoding="utf-8")
    a = robocal("compensate", run / "run", run / "q.csv")
    b = robocal("compensate", run / "run" / "calibrated.yaml", run / "q.csv", "--nominal", run / "robot.yaml")
    assert a.status == b.status == 0
    names = "j1 [deg],j2 [deg],j3 [deg],tcp_x [mm]"
    np.testing.assert_allclose(numbers(table(a.out), names), numbers(table(b.out), names), atol=1e-9)
    assert {r["status"] for r in table(a.out)} == {"orientation relaxed"}


def test_the_tool_is_chosen(ur10: Path, tmp_path: Path) -> None:
    """With the calibrated tool in both models the tool's change is no error of the arm; with own tools it is."""
    nominal = open_robot(ur10 / "nominal.yaml").chain
    real = nominal.with_values({"tool.z": 0.05, "j2.theta": 1e-3})
    (tmp_path / "real.yaml").write_text(describe(real), encoding="utf-8")
    q = sample_joints(nominal, 5, np.random.default_rng(3)) * 0.3 + 0.5
    lines = [",".join(f"j{i} [rad]" for i in range(1, 7)), *(",".join(map(repr, row)) for row in q.tolist())]
    (tmp_path / "q.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")

    def before(tool: str) -> float:
        made = compensate(
            str(tmp_path / "real.yaml"), str(tmp_path / "q.csv"), nominal=str(ur10 / "nominal.yaml"), tool=tool
        )
        assert any(w.code is Code.TOOL_CHANGED for w in made.warnings)
        assert made.errors.before is not None
        return made.errors.before.mean

    assert before("own") > 49 and before("calibrated") < 3 and before("nominal") < 3
    assert before("0,0,50,0,0,0") == pytest.approx(before("calibrated"), rel=1e-9)
    said = ("--tool", "0,0", "calibrated")
    robocal(
        "compensate", tmp_path / "real.yaml", tmp_path / "q.csv", "--nominal", ur10 / "nominal.yaml", "--tool", "0,0"
    ).assert_refused(*said)


def refused(run: Path, name: str, text: str, *words: str, robot: str = "run") -> Ran:
    (run / name).write_text(text, encoding="utf-8")
    before = files(run)
    ran = robocal("compensate", run / robot, run / name, "-o", run / "nowhere")
    ran.assert_refused(*words)
    assert files(run) == before
    return ran


@pytest.mark.parametrize("header", ["target", "name", "id"])
def test_targets_keep_their_names(run: Path, tmp_path: Path, header: str) -> None:
    (tmp_path / "t.csv").write_text(
        f"{header},x [mm],y [mm],z [mm]\nweld 1,200,50,320\ntoo far,90000,0,0\n", encoding="utf-8"
    )
    ran = robocal("compensate", run / "run", tmp_path / "t.csv")
    assert [r["target"] for r in table(ran.out)] == ["weld 1", "too far"]
    assert "not read" not in ran.remarks and "too far" in ran.remarks


def test_bad_targets_are_refused_by_name(run: Path) -> None:
    refused(run, "bad.csv", "a,b\n1,2\n", "bad.csv", "there are no targets", "x [mm]")
    refused(run, "bad.csv", "x [mm],y [mm],z [mm]\n1,2,three\n", "bad.csv", "row 2", "column z", "three")
    refused(run, "bad.csv", "x,y,z\n1,2,3\n", "bad.csv", "unit", "x [mm]")
    refused(run, "bad.csv", "j1 [mm],j2 [deg],j3 [deg]\n1,2,3\n", "bad.csv", "mm", "an angle")
    refused(run, "bad.yaml", "robocal: 1\nkind: position\nfile: t.csv\n", "bad.yaml", "targets", "position")
    refused(run, "bad.yaml", "robocal: 1\nkind: targets\nfile: t.csv\npositon: {}\n", "bad.yaml", "position")
    refused(run, "bad.csv", "x [mm],y [mm],z [mm]\n1,2,3\n", "--nominal", "run folder", robot="run/calibrated.yaml")


def test_the_nominal_model_of_another_robot_is_suspected(run: Path, tmp_path: Path) -> None:
    other = (run / "robot.yaml").read_text(encoding="utf-8").replace("r: 300", "r: 700")
    (tmp_path / "other.yaml").write_text(other, encoding="utf-8")
    (tmp_path / "q.csv").write_text("j1 [deg],j2 [deg],j3 [deg]\n10,20,30\n", encoding="utf-8")
    words = ("compensate", run / "run" / "calibrated.yaml", tmp_path / "q.csv", "--nominal")
    assert "two models differ" in robocal(*words, tmp_path / "other.yaml").err
    assert "two models differ" not in robocal(*words, run / "robot.yaml").err


def test_a_residual_layer_is_said_to_be_left_out(run: Path, tmp_path: Path) -> None:
    earlier(shutil.copytree(run / "run", tmp_path / "run"))
    (tmp_path / "run" / "layer.json").write_text("{}", encoding="utf-8")
    (tmp_path / "q.csv").write_text("j1 [deg],j2 [deg],j3 [deg]\n10,20,30\n", encoding="utf-8")
    assert "residual layer" in robocal("compensate", tmp_path / "run", tmp_path / "q.csv").err
    assert "residual layer" not in robocal("compensate", run / "run", tmp_path / "q.csv").err


def test_a_calibration_that_was_not_proven_is_not_trusted(run: Path, tmp_path: Path) -> None:
    small(tmp_path, error=0.0)
    robocal("identify", tmp_path / "robot.yaml", tmp_path / "data.yaml", "-o", tmp_path / "run")
    (tmp_path / "q.csv").write_text("j1 [deg],j2 [deg],j3 [deg]\n10,20,30\n", encoding="utf-8")
    ran = robocal("compensate", tmp_path / "run", tmp_path / "q.csv")
    assert ran.status == 3 and "not known to help" in ran.err
