"""robocal cable poses: a list that the other verbs read back, a program to follow, poses worth measuring, and what is refused."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cli.runs import files, robocal
from listings import rows_of

from robocal.cables.geometry import cable_robot
from robocal.cables.interference import first_contact, hull
from robocal.cables.pulley import Pulleys
from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.write import describe_cable
from robocal.files.units import UNITS
from robocal.geometry import se3, so3

EXAMPLES = Path(__file__).parents[2] / "examples"

CORNERS = np.array([(-2, -1.5), (-2, 1.5), (2, 1.5), (2, -1.5)])


def robot(**more):
    a = [(x, y, z) for z, lean in ((0.1, 0.2), (3.0, -0.2)) for x, y in CORNERS + [0.0, lean]]
    b = [(0.15 * x, 0.1 * y, z) for z in (0.1, -0.12) for x, y in CORNERS + 0.1]
    known = {"mass": 8.0, "limits": np.tile([10.0, 400.0], (8, 1)), "diameter": np.full(8, 0.004)}
    return cable_robot("eight", a, b, np.linspace(0, 0.7, 8), **{**known, "elasticity": np.full(8, 2e-5), **more})


def planar(**more):
    a = [[-2, 0, 3], [2, 0, 3], [0, 0, 0]]
    known = {"mass": 2.0, "limits": np.tile([5.0, 60.0], (3, 1)), "diameter": np.full(3, 0.003)}
    return cable_robot("planar", a, np.zeros((3, 3)), degrees="2T", plane="xz", **{**known, **more})


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "robot.yaml").write_text(describe_cable(robot()))
    (tmp_path / "planar.yaml").write_text(describe_cable(planar()))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def rows(path):
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


def numbers(table, *columns):
    return np.array([[float(row[c]) for c in columns] for row in table])


CABLES = [f"c{i}" for i in range(1, 9)]
LENGTHS, TENSIONS = [f"{c} [m]" for c in CABLES], [f"{c}.tension [N]" for c in CABLES]
PLACE = ["x [m]", "y [m]", "z [m]", "rx [deg]", "ry [deg]", "rz [deg]"]


def test_a_list_is_read_back_by_every_verb(folder):
    ran = robocal("cable", "poses", "robot.yaml", "-n", 30, "--seed", 3, "-o", "list")
    assert ran.status == 0 and ran.remarks == ""
    assert files(folder / "list") == {"poses.csv", "program.csv", "list.json", "report.html"}
    listed = rows(folder / "list" / "poses.csv")
    assert len(listed) == 30 and listed[0]["id"] == "p01"
    tension = numbers(listed, *TENSIONS)
    assert (tension >= 10 - 1e-6).all() and (tension <= 400 + 1e-6).all()
    # inverse: the same lengths, stretched by the same tensions
    ran = robocal("cable", "inverse", "robot.yaml", "list/poses.csv", "-o", "lengths.csv")
    assert ran.status == 0 and ran.remarks == ""
    np.testing.assert_allclose(numbers(rows(folder / "lengths.csv"), *LENGTHS), numbers(listed, *LENGTHS), atol=2e-9)
    # forward: the same poses
    ran = robocal("cable", "forward", "robot.yaml", "list/poses.csv", "--sigma", 0.001, "-o", "back.csv")
    assert ran.status == 0, ran.err
    np.testing.assert_allclose(numbers(rows(folder / "back.csv"), *PLACE), numbers(listed, *PLACE), atol=1e-6)
    # tension: the same tensions
    ran = robocal("cable", "tension", "robot.yaml", "list/poses.csv", "-o", "held")
    assert ran.status == 0, ran.err
    np.testing.assert_allclose(numbers(rows(folder / "held" / "tensions.csv"), *TENSIONS), tension, atol=1e-5)


def test_without_elasticity_lengths_are_geometric_and_read_back_too(folder):
    (folder / "stiff.yaml").write_text(describe_cable(robot(elasticity=None)))
    robocal("cable", "poses", "stiff.yaml", "-n", 5, "-o", "list")
    assert json.loads((folder / "list" / "list.json").read_text())["lengths"] == "geometric"
    listed = rows(folder / "list" / "poses.csv")
    for verb in ("inverse", "forward"):
        ran = robocal("cable", verb, "stiff.yaml", "list/poses.csv", "-o", f"{verb}.csv")
        assert ran.status == 0 and "the elasticity of eight is not known" in ran.err
    np.testing.assert_allclose(numbers(rows(folder / "inverse.csv"), *LENGTHS), numbers(listed, *LENGTHS), atol=2e-9)


def test_the_program_goes_out_and_back(folder):
    robocal("cable", "poses", "robot.yaml", "-n", 6, "--steps", 4, "-o", "list")
    program = rows(folder / "list" / "program.csv")
    listed = {row["id"]: row for row in rows(folder / "list" / "poses.csv")}
    assert [row["id"] for row in program] == [str(i) for i in range(1 + 6 * 8)]
    assert [row["way"] for row in program[:9]] == ["start", "out", "out", "out", "pose", *["back"] * 4]
    assert numbers(program[:9], "share")[:, 0].tolist() == [0, 0.25, 0.5, 0.75, 1, 0.75, 0.5, 0.25, 0]
    assert [row["pose"] for row in program if row["way"] == "pose"] == list(listed)
    for row in program:
        if row["way"] == "pose":
            assert all(row[c] == listed[row["pose"]][c] for c in (*PLACE, *LENGTHS, *TENSIONS))
    at = numbers(program, *PLACE)
    np.testing.assert_array_equal(at[0::8], np.tile(at[0], (7, 1)))
    # From waypoint to waypoint the platform moves straight, and nothing touches.
    machine = robot()
    at[:, 3:] = np.radians(at[:, 3:])
    pose = se3.from_vector(at)
    step = np.diff(pose[:, :3, 3], axis=0)
    turn = so3.log(pose[1:, :3, :3] @ pose[:-1, :3, :3].swapaxes(1, 2))
    met = first_contact(machine.a, machine.b, pose[:-1], step, turn, diameter=machine.diameter, body=hull(machine.b))
    assert met.free.all()
    tension = numbers(program, *TENSIONS)
    assert (tension >= 10 - 1e-6).all() and (tension <= 400 + 1e-6).all()


def test_the_document_says_what_stopped_whom(folder):
    ran = robocal("cable", "poses", "robot.yaml", "-n", 80, "--mu", 0.9, "--json")
    found = ran.document
    assert sum(found["stopped_by"].values()) == 80 and found["stopped_by"]["statics"] > 0
    assert found["reached"] == found["stopped_by"]["box"] / 80 and found["mu"] == 0.9
    for row in rows_of(found["poses"]):
        assert (row["contact"] is not None) == (row["limit"] in ("cable-cable", "cable-platform"))
        assert 0 < row["lambda"] <= 0.9 and (row["lambda"] == pytest.approx(0.9)) == (row["limit"] == "box")
    assert found["start"]["nearest"][0] in CABLES and found["start"]["margin"]["value"] > 0
    assert robocal("cable", "poses", "robot.yaml", "-n", 80, "--mu", 0.9, "--json").document["poses"] == found["poses"]
    assert robocal("cable", "poses", "robot.yaml", "-n", 80, "--seed", 1, "--json").document["poses"] != found["poses"]


def test_poses_worth_measuring(folder):
    ran = robocal("cable", "poses", "robot.yaml", "-n", 60, "--choose", 8, "--sigma", 0.002, "-o", "list")
    assert ran.status == 0 and "as if an instrument measured them exactly" in ran.remarks and "frame anchors" in ran.out
    page = (folder / "list" / "report.html").read_text(encoding="utf-8")
    assert "from poses as if measured exactly" in page and "0.000 deg" not in page
    found = json.loads((folder / "list" / "list.json").read_text())["choice"]
    assert len(set(found["poses"])) == 8 and found["sigma"]["length"] == {"value": 0.002, "unit": "m"}
    rms = found["expected_rms"]
    assert rms["all"]["a"] < rms["chosen"]["a"] < rms["random"]["a"]
    listed, chosen = rows(folder / "list" / "poses.csv"), rows(folder / "list" / "chosen.csv")
    assert [row["id"] for row in chosen] == found["poses"]
    assert {row["id"]: row["rank"] for row in listed if row["rank"]} == {
        n: str(i + 1) for i, n in enumerate(found["poses"])
    }
    program = rows(folder / "list" / "program.csv")
    assert [row["pose"] for row in program if row["way"] == "pose"] == found["poses"]
    half = robocal("cable", "poses", "robot.yaml", "-n", 60, "--choose", 8, "--sigma", 0.001, "--json").document[
        "choice"
    ]
    assert half["expected_rms"]["all"]["a"] == pytest.approx(rms["all"]["a"] / 2, rel=0.01)
    worse = robocal(
        "cable", "poses", "robot.yaml", "-n", 60, "--choose", 8, "--sigma", 0.002, "--pose-noise", "0.002,0.1", "--json"
    )
    assert worse.document["choice"]["expected_rms"]["chosen"]["a"] > rms["chosen"]["a"]
    said = robocal("cable", "poses", "robot.yaml", "-n", 10, "--choose", 4)
    metre = robocal("cable", "poses", "robot.yaml", "-n", 10, "--choose", 4, "--sigma", 1)
    assert "--sigma 1 m is larger than" in metre.err
    assert "1 mm is assumed" in said.err and said.out.splitlines()[0].endswith(",rank")


def test_units_of_the_file(folder):
    text = describe_cable(
        robot(), replace(read_cable(folder / "robot.yaml").units, length=UNITS["mm"], force=UNITS["kN"])
    )
    (folder / "mm.yaml").write_text(text)
    one = robocal(
        "cable",
        "poses",
        "robot.yaml",
        "-n",
        5,
        "--box",
        "-1,-1,0.5,1,1,2.5",
        "--limits",
        "20,300",
        "--diameter",
        0.003,
        "--json",
    )
    two = robocal(
        "cable",
        "poses",
        "mm.yaml",
        "-n",
        5,
        "--box",
        "-1000,-1000,500,1000,1000,2500",
        "--limits",
        "0.02,0.3",
        "--diameter",
        3,
        "--json",
    )
    for a, b in zip(rows_of(one.document["poses"]), rows_of(two.document["poses"]), strict=True):
        np.testing.assert_allclose(b["T_base_platform"], a["T_base_platform"], atol=1e-9)
        np.testing.assert_allclose(b["tension"], a["tension"], atol=1e-4)
    header = robocal("cable", "poses", "mm.yaml", "-n", 1).out.splitlines()[0]
    assert "x [mm]" in header and "c1 [mm]" in header and "c1.tension [kN]" in header


def test_a_planar_robot_stays_in_its_plane(folder):
    ran = robocal("cable", "poses", "planar.yaml", "-n", 40, "--choose", 6, "-o", "list")
    assert ran.status == 0, ran.err
    at = numbers(rows(folder / "list" / "poses.csv"), *PLACE)
    assert not at[:, [1, 3, 4, 5]].any() and (at[:, [0, 2]].std(axis=0) > 0.1).all()
    assert robocal("cable", "tension", "planar.yaml", "list/program.csv").status == 0


def test_a_singular_start_is_refused(folder):
    """Eight cables that all point away from one point: upright, nothing turns the platform about the vertical."""
    corners = [f"[{x}, {y}, {z}]" for z in (0, 2) for x, y in ((-2, -2), (2, -2), (2, 2), (-2, 2))]
    attach = [f"[{x}, {y}, {z}]" for z in (-0.1, 0.1) for x, y in ((-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1))]
    (folder / "robot.yaml").write_text(
        f"robocal: 1\nname: radial\nkind: cable\nunits: {{length: m}}\nframe_anchors: [{', '.join(corners)}]\n"
        f"platform_anchors: [{', '.join(attach)}]\nevery_cable: {{tension: [10, 500], diameter: 0.004}}\n"
        "platform: {mass: 10}\n"
    )
    # Held it is, but every motion would end where it begins.
    robocal("cable", "poses", "robot.yaml", "-n", 5).assert_refused(
        "--start", "X_0 is a singular pose", "no disturbance", "another; none of 15 cells"
    )


def test_a_start_that_will_not_do_is_refused_with_one_that_will(folder):
    heavy = ["cable", "poses", "robot.yaml", "-n", 5, "--limits", "10,300", "--payload", 52]
    robocal(*heavy, "--start", "0,0,2.95").assert_refused(
        "--start", "cannot be held", "is missing", "fz", "--start best"
    )
    best = robocal(*heavy, "--start", "best", "--json").document["start"]
    assert best["margin"]["value"] > 0
    said = robocal(*heavy, "--start", "0,0,2.95").err.split("such as --start ")[1].split()[0]
    assert robocal(*heavy, "--start", said, "--json").document["start"]["margin"]["value"] == pytest.approx(
        best["margin"]["value"], rel=1e-3
    )
    robocal("cable", "poses", "robot.yaml", "--diameter", 0.4).assert_refused(
        "at the start X_0 c", "meets", "none of 15 cells"
    )
    robocal("cable", "poses", "robot.yaml", "--payload", 1e5, "--start", "best").assert_refused(
        "--start", "none of 15 cells"
    )
    robot = read_cable(folder / "robot.yaml")
    at = ",".join(f"{v:.17g}" for v in robot.units.length.from_si(robot.robot.a[0] - robot.robot.b[0]))
    robocal("cable", "poses", "robot.yaml", f"--start={at}").assert_refused(
        "error: --start:", "c1 has no direction", "X_0"
    )
    turned = robocal("cable", "poses", "robot.yaml", "-n", 3, "--start", "0,0,1.6,0,0,5", "--json").document["start"]
    assert turned["T_base_platform"][0][1] == pytest.approx(-np.sin(np.radians(5)))


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--mu", 0], ["--mu"]),
        (["--mu", "nan"], ["--mu"]),
        (["--start", "here"], ["--start", "mean, best"]),
        (["--start", "0,0,x"], ["--start"]),
        (["--box", "0,0,0,1,1"], ["--box"]),
        (["--box", "1,0,0,-1,1,1"], ["--box", "an empty box"]),
        (["--scale", -1], ["--scale"]),
        (["--scale", "1e300"], ["--scale"]),
        (["--turn", "nan"], ["--turn"]),
        (["--turn", 181], ["--turn", "half a turn"]),
        (["--box", "0,0,0,1,1,1e300"], ["--box"]),
        (["--body", "ball"], ["--body", "hull, box, none"]),
        (["--body", "0.1,0.1,0.1"], ["outside the platform's body"]),
        (["--diameter", -1], ["--diameter"]),
        (["--diameter", "nan"], ["--diameter"]),
        (["--relief", 0], ["--relief"]),
        (["-n", 10_000, "--steps", 100], ["--steps", "too many waypoints"]),
        (["--limits", "100,10"], ["--limits"]),
        (["--method", "nearest"], ["--method", "norm"]),
        (["--method", "closed", "--limits", "10,60"], ["--method", "none at"]),
        (["--choose", 0], ["--choose"]),
        (["--choose", 300], ["--choose"]),
        (["--choose", 5, "--criterion", "Z"], ["--criterion"]),
        (["--choose", 5, "--sigma", 0], ["--sigma"]),
        (["--choose", 5, "--sigma", "1e300"], ["noise of a length"]),
        (["--choose", 5, "--pose-noise", "1"], ["--pose-noise"]),
        (["--choose", 5, "--pose-noise", "-1,0"], ["--pose-noise"]),
        (["--sigma", 5], ["--sigma", "--choose N"]),
        (["--encoders-only"], ["--encoders-only", "--choose N"]),
        (["--pose-noise", "1,0.1"], ["--pose-noise", "--choose N"]),
        (["--criterion", "D"], ["--criterion", "--choose N"]),
        (["--box", "-1,-1,0,1,1,1", "--scale", 2], ["--scale", "--box or --scale"]),
        (["--steps", 0], ["--steps"]),
        (["-n", 0], ["--poses"]),
    ],
)
def test_bad_wishes_are_refused(folder, more, words):
    before = files(folder)
    robocal("cable", "poses", "robot.yaml", "-o", "list", *more).assert_refused(*words)
    assert files(folder) == before


@pytest.mark.parametrize(
    ("known", "words"),
    [({"mass": None}, ["robot.yaml", "platform.mass"]), ({"limits": None}, ["robot.yaml", "every_cable.tension"])],
)
def test_what_the_file_has_to_know(folder, known, words):
    (folder / "robot.yaml").write_text(describe_cable(robot(**known)))
    robocal("cable", "poses", "robot.yaml").assert_refused(*words)


def test_a_robot_that_its_cables_cannot_hold(folder):
    a, b = robot().a[:5], robot().b[:5]
    machine = cable_robot("five", a, b, mass=8.0, limits=np.tile([10.0, 400.0], (5, 1)))
    (folder / "five.yaml").write_text(describe_cable(machine))
    robocal("cable", "poses", "five.yaml").assert_refused(
        "five.yaml", "fewer cables than degrees of freedom", "5 cables"
    )


def test_contacts_are_looked_for_over_pulleys_and_nothing_else_is_said(folder):
    wheels = Pulleys(np.full(8, 0.03), np.tile([0.0, 0.0, 1.0], (8, 1)))
    (folder / "wheels.yaml").write_text(describe_cable(robot(pulleys=wheels)))
    ran = robocal("cable", "poses", "wheels.yaml", "-n", 20, "-o", "list")
    assert ran.status == 0 and "pulleys" not in ran.said, ran.said
    # Lengths and tensions know them.
    assert robocal("cable", "tension", "wheels.yaml", "list/program.csv").status == 0


def test_a_robot_that_lies_needs_no_mass(folder):
    a = [[-2, -1, 0], [2, -1, 0], [2, 1, 0], [-2, 1, 0]]
    machine = cable_robot("lying", a, np.zeros((4, 3)), degrees="2T", plane="xy", limits=np.tile([5.0, 60.0], (4, 1)))
    (folder / "lying.yaml").write_text(describe_cable(machine))
    ran = robocal(
        "cable", "poses", "lying.yaml", "-n", 50, "--diameter", 0.002, "--choose", 5, "--sigma", 0.001, "--json"
    )
    assert ran.status == 0, ran.err
    at = np.array([row["T_base_platform"] for row in rows_of(ran.document["poses"])])
    assert not at[:, 2, 3].any() and ran.document["choice"]["parameters"][:3] == ["c1.ax", "c1.ay", "c1.l0"]


def test_nothing_is_overwritten_and_lines_are_said(folder):
    (folder / "list").mkdir()
    (folder / "list" / "program.csv").write_text("mine")
    robocal("cable", "poses", "robot.yaml", "-n", 3, "-o", "list").assert_refused("exists", "--force")
    assert files(folder / "list") == {"program.csv"}
    assert robocal("cable", "poses", "robot.yaml", "-n", 3, "-o", "list", "--force").status == 0
    (folder / "thin.yaml").write_text(describe_cable(robot(diameter=None)))
    assert "contacts are those of lines without thickness" in robocal("cable", "poses", "thin.yaml", "-n", 3).err


@pytest.mark.parametrize("robot", ["laval", "cogiro"])
def test_the_box_is_that_of_the_frame_and_ends_at_the_floor(robot, shared_data, tmp_path):
    """No platform anchor of a list is below the floor, and the list covers four fifths of the height of the workspace."""
    path = (
        shared_data / "cable-robots" / f"{robot}.yaml" if robot == "cogiro" else EXAMPLES / "cable-laval" / "robot.yaml"
    )
    made = robocal("cable", "poses", path, "--start", "best", "--json").document
    held = robocal("cable", "workspace", path, "--cells", 25, "--json").document
    t = np.array([p["T_base_platform"] for p in rows_of(made["poses"])])
    b = read_cable(path).robot.b
    anchors = t[:, None, :3, 3] + np.einsum("kij,mj->kmi", t[:, :3, :3], b)
    assert anchors[..., 2].min() > 0.0
    low, high = held["extent"]["value"][2]
    assert np.ptp(t[:, 2, 3]) > 0.8 * (high - low)
