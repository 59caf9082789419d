"""robocal cable inverse and forward: lists in, lists out, and what is refused or not trusted."""

from __future__ import annotations

import csv
import re
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from cables.cable_robots import box
from cli.runs import files, robocal
from listings import lengths_of, rows_of

from robocal.cables.geometry import cable_robot
from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.write import describe_cable

EXAMPLES = Path(__file__).parents[2] / "examples"

POSES = """id,x [mm],y [mm],z [mm],rx [deg],ry [deg],rz [deg]
low,100,-200,900,0,0,0
high,300,200,1600,5,3,-10
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "robot.yaml").write_text(describe_cable(box()))
    (tmp_path / "poses.csv").write_text(POSES)
    return tmp_path


def values(path):
    rows = [line.split(",") for line in path.read_text().splitlines()]
    return rows[0], np.array([[float(c) for c in row[1:7]] for row in rows[1:]])


def test_there_and_back(folder):
    robot, lengths, back = folder / "robot.yaml", folder / "lengths.csv", folder / "back.csv"
    ran = robocal("cable", "inverse", robot, folder / "poses.csv", "-o", lengths)
    assert (ran.status, ran.out.strip()) == (0, str(lengths))
    ran = robocal("cable", "forward", robot, lengths, "--sigma", 0.001, "-o", back)
    assert ran.status == 0 and ran.remarks == ""
    header, found = values(back)
    assert header[1:7] == ["x [m]", "y [m]", "z [m]", "rx [deg]", "ry [deg]", "rz [deg]"] and header[-1] == "solutions"
    np.testing.assert_allclose(found, [[0.1, -0.2, 0.9, 0, 0, 0], [0.3, 0.2, 1.6, 5, 3, -10]], atol=1e-8)
    shown = robocal("cable", "forward", robot, lengths, "--json").document
    assert [p["id"] for p in rows_of(shown["poses"])] == ["low", "high"]
    assert all(p["solutions"] == 1 and p["converged"] for p in rows_of(shown["poses"]))
    assert np.shape(rows_of(shown["poses"])[0]["covariance"]) == (6, 6) and shown["written"] is None


def test_lengths_that_no_pose_explains_are_not_trusted(folder):
    robot, lengths = folder / "robot.yaml", folder / "lengths.csv"
    text = robocal("cable", "inverse", robot, folder / "poses.csv").out
    first = text.splitlines()[1].split(",")
    wrong = ",".join([first[0], str(float(first[1]) + 0.2), *first[2:]])
    lengths.write_text(text.replace(",".join(first), wrong))
    ran = robocal("cable", "forward", robot, lengths, "--sigma", 0.001)
    assert ran.status == 3 and "low: no pose explains these lengths" in ran.err and "high" not in ran.err
    ran = robocal("cable", "forward", robot, lengths)
    assert ran.status == 3 and re.search(r"the residual of its lengths is [\d.]+ mm", ran.err) and "high" not in ran.err


def test_two_poses_are_not_trusted(folder):
    robot = box()
    a, b = robot.a.copy(), robot.b.copy()
    a[:, 2], b[:, 2] = 3.0, 0.0
    a[:4, :2] *= 0.8
    (folder / "flat.yaml").write_text(describe_cable(cable_robot("flat", a, b)))
    (folder / "l.csv").write_text(robocal("cable", "inverse", folder / "flat.yaml", folder / "poses.csv").out)
    ran = robocal("cable", "forward", folder / "flat.yaml", folder / "l.csv", "--starts", 40)
    assert ran.status == 3 and "low: 2 poses explain these lengths equally well" in ran.err
    assert robocal("cable", "forward", folder / "flat.yaml", folder / "l.csv", "--starts", 0).status == 0


def test_tensions_of_the_list_or_of_all(folder):
    text = describe_cable(box()) + "every_cable: {elasticity: 2.5e-5, density: 0.122}\n"
    (folder / "robot.yaml").write_text(text)
    plain, pulled, sagging = (
        lengths_of(robocal("cable", "inverse", folder / "robot.yaml", folder / "poses.csv", "--json", *more).document)
        for more in ((), ("--tension", 80), ("--tension", 80, "--sag"))
    )
    full = np.array(plain["low"]) + box().zeros
    np.testing.assert_allclose(np.array(pulled["low"]) + box().zeros, full / 1.002, rtol=1e-12)
    assert 0 < (np.array(sagging["low"]) - pulled["low"]).max() < 1e-3
    head, *rows = POSES.splitlines()
    head += "".join(f",c{i}.tension [N]" for i in range(1, 9))
    listed = "\n".join([head, *(row + ",80" * 8 for row in rows)])
    (folder / "tense.csv").write_text(listed)
    again = lengths_of(robocal("cable", "inverse", folder / "robot.yaml", folder / "tense.csv", "--json").document)
    assert again == pulled
    robocal("cable", "inverse", folder / "robot.yaml", folder / "tense.csv", "--tension", 80).assert_refused("twice")


def test_one_name_is_one_length(folder):
    """c1 is what the sensor of cable c1 shows, in every list; where nobody says how it is stretched it is called c1.geometric."""
    robot, lengths = folder / "robot.yaml", folder / "lengths.csv"
    robot.write_text(describe_cable(box()) + "every_cable: {elasticity: 2.5e-5}\n")
    plain = robocal("cable", "inverse", robot, folder / "poses.csv", "-o", lengths)
    assert (
        plain.status == 0
        and "these lengths are geometric" in plain.said
        and values(lengths)[0][1] == "c1.geometric [m]"
    )
    back = robocal("cable", "forward", robot, lengths, "--sigma", 0.001, "-o", folder / "back.csv")
    assert (back.status, back.remarks) == (0, "")
    np.testing.assert_allclose(values(folder / "back.csv")[1][0], [0.1, -0.2, 0.9, 0, 0, 0], atol=1e-8)
    robocal("cable", "forward", robot, lengths, "--tension", 80).assert_refused(
        "geometric lengths are not stretched", "--tension"
    )

    pulled = robocal("cable", "inverse", robot, folder / "poses.csv", "--tension", 80, "-o", lengths, "--force")
    assert pulled.remarks == "" and values(lengths)[0][1] == "c1 [m]"
    assert "taken as geometric" in robocal("cable", "forward", robot, lengths).said
    told = robocal("cable", "forward", robot, lengths, "--tension", 80, "-o", folder / "back.csv", "--force")
    assert (told.status, told.remarks) == (0, "")
    np.testing.assert_allclose(values(folder / "back.csv")[1][1], [0.3, 0.2, 1.6, 5, 3, -10], atol=1e-8)


def shown_lengths(path):
    """Of every row, what the sensors show."""
    rows = csv.DictReader(path.read_text().splitlines())
    return {r["id"]: [float(v) for k, v in r.items() if re.fullmatch(r"c\d+ \[\w+\]", k)] for r in rows}


def test_a_program_and_inverse_mean_the_same_length(tmp_path):
    robocal("new", "cable", "-o", tmp_path)
    robot = tmp_path / "robot.yaml"
    assert "elasticity:" in robot.read_text()
    listed = tmp_path / "listed"
    assert robocal("cable", "poses", robot, "-n", 3, "--start", "0,0,1", "--body", "none", "-o", listed).status == 0
    again = robocal("cable", "inverse", robot, listed / "poses.csv", "-o", tmp_path / "again.csv")
    assert again.status == 0 and "geometric" not in again.said
    columns = [shown_lengths(path) for path in (listed / "poses.csv", tmp_path / "again.csv")]
    for name, row in columns[0].items():
        assert len(row) == 8
        np.testing.assert_allclose(columns[1][name], row, atol=2e-9)


def test_there_and_back_sagging_over_pulleys(folder):
    """The same way in for every model: what `inverse --sag` says of a robot with pulleys, `forward --sag` takes back."""
    every = "every_cable: {elasticity: 2.5e-5, density: 0.5, pulley: {radius: 0.05, axis: [0.1, 0, 1]}}\n"
    robot, lengths = folder / "robot.yaml", folder / "lengths.csv"
    robot.write_text(describe_cable(box()) + every)
    more = ("--tension", 60, "--sag")
    assert robocal("cable", "inverse", robot, folder / "poses.csv", "-o", lengths, *more).status == 0
    back = robocal("cable", "forward", robot, lengths, "--sigma", 0.0001, "-o", folder / "back.csv", *more)
    assert back.status == 0, back.err
    _, found = values(folder / "back.csv")
    np.testing.assert_allclose(found, [[0.1, -0.2, 0.9, 0, 0, 0], [0.3, 0.2, 1.6, 5, 3, -10]], atol=1e-7)
    for less in (("--tension", 60), ()):
        robocal("cable", "forward", robot, lengths, "-o", folder / "other.csv", "--force", *less)
        assert np.abs(values(folder / "other.csv")[1] - found).max() > 1e-5


def test_a_pose_that_is_not_found_is_not_written(folder):
    """Cables so heavy that their tension carries them nowhere: no start stands in for the pose."""
    robot, lengths = folder / "robot.yaml", folder / "lengths.csv"
    robot.write_text(describe_cable(box()) + "every_cable: {elasticity: 2.5e-5, density: 20}\n")
    lengths.write_text("id," + ",".join(f"c{i} [m]" for i in range(1, 9)) + "\nlow" + ",2.5" * 8 + "\n")
    ran = robocal("cable", "forward", robot, lengths, "--tension", 15, "--sag")
    assert ran.status == 3 and "low: no pose was found at which the cables can hang with these lengths" in ran.err
    assert ran.out.splitlines()[1] == "low" + "," * 9 + ",0"
    shown = rows_of(robocal("cable", "forward", robot, lengths, "--tension", 15, "--sag", "--json").document["poses"])[
        0
    ]
    assert shown["T_base_platform"] is None and shown["residual"] is None and not shown["converged"]


def test_a_singular_pose_is_not_trusted(folder):
    """A flat platform in the plane of its frame: to first order no length says how high it is."""
    robot = box()
    a, b = robot.a.copy(), robot.b.copy()
    a[:, 2], b[:, 2] = 3.0, 0.0
    a[:4, :2] *= 0.8
    (folder / "flat.yaml").write_text(describe_cable(cable_robot("flat", a, b)))
    (folder / "poses.csv").write_text(POSES.splitlines()[0] + "\nlevel,300,-200,3000,0,0,10\n")
    (folder / "l.csv").write_text(robocal("cable", "inverse", folder / "flat.yaml", folder / "poses.csv").out)
    ran = robocal("cable", "forward", folder / "flat.yaml", folder / "l.csv", "--sigma", 0.0001)
    assert ran.status == 3 and "level: near this pose the lengths do not determine where the platform is" in ran.err


@pytest.mark.parametrize(
    ("verb", "change", "more", "words"),
    [
        ("inverse", ("rz [deg]", "rz"), (), ["poses.csv", "column rz", "unit is missing"]),
        ("inverse", ("z [mm]", "zz [mm]"), (), ["poses.csv", "column z", "no such column"]),
        ("inverse", ("1600", "16OO"), (), ["poses.csv", "row 3", "column z"]),
        ("inverse", ("", ""), ("--tension", "50"), ["robot.yaml", "elasticity of box is not known"]),
        ("inverse", ("rz [deg]", "rz [deg],C1.tension [N]"), (), ["no column of this name is read", "c1.tension"]),
        (
            "tension",
            ("rz [deg]", "rz [deg],Fx [N]"),
            ("--limits", "10,400", "--mass", "5"),
            ["column Fx", "no column of this name is read", "expected fx"],
        ),
        (
            "tension",
            ("rz [deg]", "rz [deg],mx"),
            ("--limits", "10,400", "--mass", "5"),
            ["column mx", "a header such as mx [Nm]"],
        ),
        ("inverse", ("", ""), ("--tension", "-5"), ["--tension", "cannot push"]),
        ("inverse", ("", ""), ("--sag",), ["--sag", "needs its tension", "c1.tension [N]", "--tension"]),
        ("forward", ("", ""), (), ["poses.csv", "column c1", "no such column"]),
        ("forward", ("id,x [mm],y [mm]", "id,c1 [mm],c2 [deg]"), (), ["poses.csv", "column c2", "a length is needed"]),
        ("forward", ("", ""), ("--starts", "-1"), ["--starts"]),
    ],
)
def test_bad_input_is_refused(folder, verb, change, more, words):
    more_cells = ",5" * (change[1].count(",") - change[0].count(","))
    text = POSES.replace(*change) if change[0] else POSES
    (folder / "poses.csv").write_text(text.replace(",0\n", f",0{more_cells}\n").replace("-10\n", f"-10{more_cells}\n"))
    before = files(folder)
    ran = robocal("cable", verb, folder / "robot.yaml", folder / "poses.csv", "-o", folder / "out.csv", *more)
    ran.assert_refused(*words)
    assert files(folder) == before


def test_no_length_and_no_overwriting(folder):
    robot, poses = folder / "robot.yaml", folder / "poses.csv"
    a, b = box().a[0], box().b[0]
    at = ",".join(str(float(v)) for v in (a - b) * 1000)
    poses.write_text(POSES + f"touching,{at},0,0,0\n")
    robocal("cable", "inverse", robot, poses).assert_refused("poses.csv", "cable c1 has no length", "pose 2")
    poses.write_text(POSES)
    (folder / "there.csv").write_text("mine")
    robocal("cable", "inverse", robot, poses, "-o", folder / "there.csv").assert_refused("exists", "--force")
    assert (folder / "there.csv").read_text() == "mine"
    assert robocal("cable", "inverse", robot, poses, "-o", folder / "there.csv", "--force").status == 0


def test_an_arm_is_refused_and_a_cable_robot_is_no_arm(folder):
    (folder / "arm.yaml").write_text(robocal("export", "ur10").out)
    robocal("cable", "inverse", folder / "arm.yaml", folder / "poses.csv").assert_refused("this is an arm")
    robocal("export", folder / "robot.yaml", "--format", "dh").assert_refused("cable robot")


@pytest.mark.parametrize(
    ("verb", "lists", "options"),
    [
        ("inverse", ["poses.csv"], []),
        ("forward", ["lengths.csv"], []),
        ("tension", ["poses.csv"], []),
        ("workspace", [], ["--cells", 5, "--rays", 20]),
        ("poses", [], ["-n", 3, "--start", "0,0,1", "--body", "none"]),
    ],
)
def test_every_document_says_of_which_robot_and_from_which_files(verb, lists, options, tmp_path):
    robocal("new", "cable", "-o", tmp_path)
    robot = tmp_path / "robot.yaml"
    robocal("cable", "inverse", robot, tmp_path / "poses.csv", "-o", tmp_path / "lengths.csv")
    inputs = [robot, *(tmp_path / name for name in lists)]
    ran = robocal("cable", verb, *inputs, *options, "--json")
    found = ran.document
    assert ran.status == 0 and len(found["cables"]) == 8 and found["robot"] in robot.read_text()
    assert {"robocal", "assumed", "warnings", "written"} <= set(found)
    for said, file in zip(found["provenance"]["inputs"], inputs, strict=True):
        assert said == {"file": str(file), "sha256": sha256(file.read_bytes()).hexdigest()}


def test_new_cable_works_as_it_stands(tmp_path):
    cell = tmp_path / "cell"
    made = robocal("new", "cable", "-o", cell)
    assert made.status == 0 and "robocal cable poses" in made.out and "robocal check" in made.out
    data = ["lengths.csv", "lengths.yaml", "measured.csv", "poses.yaml"]
    assert sorted(p.name for p in cell.iterdir()) == sorted([*data, "poses.csv", "robot.yaml"])
    checked = robocal("check", cell / "robot.yaml", cell / "lengths.yaml", cell / "poses.yaml", "--json").document
    assert checked["configurations"] == 5 and checked["baseline_error"]["mean"] < 1e-3
    held = robocal("cable", "tension", cell / "robot.yaml", cell / "poses.csv", "--json")
    assert (held.status, held.remarks) == (0, "") and all(p["feasible"] for p in rows_of(held.document["poses"]))
    robocal("cable", "inverse", cell / "robot.yaml", cell / "poses.csv", "-o", cell / "shown.csv")
    back = rows_of(robocal("cable", "forward", cell / "robot.yaml", cell / "shown.csv", "--json").document["poses"])
    np.testing.assert_allclose(np.array(back[1]["T_base_platform"])[:3, 3], [-0.8, 0, 1.2], atol=1e-9)
    robocal("new", "cable", "-o", cell).assert_refused("robot.yaml", "--force")
    assert robocal("new", "cable", "-o", cell, "--force", "--json").document["convention"] is None
    robocal("new", "cables", "-o", cell).assert_refused("did you mean 'cable'?")
    robocal("new", "cable", "--kind", "range", "-o", tmp_path / "other").assert_refused(
        "--kind", "lengths, pose, position"
    )
    robocal("new", "cable", "--tip", "hand", "-o", tmp_path / "other").assert_refused("--tip", "a cable robot")
    assert not (tmp_path / "other").exists()
    robocal("new", cell / "robot.yaml", "--kind", "lengths", "-o", tmp_path / "monday")
    assert sorted(p.name for p in (tmp_path / "monday").iterdir()) == data[:2]


def test_a_pose_that_is_held_but_bears_nothing_more_is_remarked_on(tmp_path):
    """Every cable in one upright plane with its platform anchor: nothing holds the platform against a turn about z."""
    corners = [(x, y) for x, y in ((-2, -2), (2, -2), (2, 2), (-2, 2))]
    a = [(x, y, z) for z in (2.0, 0.0) for x, y in corners]
    b = [(x / 20, y / 20, z) for z in (-0.1, 0.1) for x, y in corners]
    robot = cable_robot("no yaw", a, b, mass=5.0, limits=np.tile([10.0, 500.0], (8, 1)))
    (tmp_path / "robot.yaml").write_text(describe_cable(robot))
    (tmp_path / "poses.csv").write_text(POSES.splitlines()[0] + "\nlevel,300,100,1000,0,0,0\n")
    ran = robocal("cable", "tension", tmp_path / "robot.yaml", tmp_path / "poses.csv")
    assert (
        ran.status == 0
        and "held, but with no margin" in ran.err
        and "disturbance moves the platform: level. " in ran.err
    )


def test_poses_may_have_quaternions(tmp_path):
    """The same lengths from a rotation vector and from the quaternion; either, not both, and of length one."""
    rng = np.random.default_rng(0)
    w = rng.uniform(-0.3, 0.3, (4, 3))
    angle = np.linalg.norm(w, axis=1, keepdims=True)
    q = np.hstack([w / angle * np.sin(angle / 2), np.cos(angle / 2)])
    place = rng.uniform(-300, 300, (4, 3)) + [0, 0, 1900]
    robot = EXAMPLES / "cable-laval" / "robot.yaml"

    def lengths(name, header, rows):
        (tmp_path / name).write_text("\n".join([header, *(",".join(f"{v:.12g}" for v in r) for r in rows)]) + "\n")
        return robocal("cable", "inverse", robot, tmp_path / name, "--json")

    one = lengths("vector.csv", "x [mm],y [mm],z [mm],rx [rad],ry [rad],rz [rad]", np.hstack([place, w])).document
    header = "x [mm],y [mm],z [mm],qx,qy,qz,qw"
    two = lengths("quaternion.csv", header, np.hstack([place, q])).document
    (a, b) = (np.array(list(lengths_of(found).values())) for found in (one, two))
    np.testing.assert_allclose(a, b, rtol=0, atol=1e-9)
    wrong = lengths("long.csv", header, np.hstack([place, 2 * q]))
    assert wrong.status == 2 and "not a unit quaternion" in wrong.remarks and "long.csv, row 2" in wrong.remarks
    turns = lengths("turns.csv", header.replace("qw", "qw [deg]"), np.hstack([place, q]))
    assert turns.status == 2 and "turns.csv" in turns.remarks and "qw" in turns.remarks and "no unit" in turns.remarks


def test_check_speaks_in_the_units_of_the_file(folder):
    text = describe_cable(box()).replace("force: N", "force: lbf")
    (folder / "robot.yaml").write_text(f"{text}every_cable: {{tension: [5, 100], elasticity: 1.0e-4}}\n")
    said = robocal("check", folder / "robot.yaml").said
    # In a narrow terminal a header takes two lines.
    assert "[lbf]" in said and "[1/lbf]" in said and "1/N" not in said


@pytest.mark.parametrize("name", ["ipanema_1.yaml", "cogiro.yaml", "laval.yaml"])
def test_check_sums_a_cable_robot_up(name, shared_data):
    ran = robocal("check", shared_data / "cable-robots" / name)
    assert ran.status == 0 and "2 cables more than freedoms" in ran.said and "frame" in ran.said
    facts = robocal("check", shared_data / "cable-robots" / name, "--json").document["robot"]["cable_robot"]
    robot = read_cable(shared_data / "cable-robots" / name).robot
    assert facts["redundancy"] == 2 and facts["mass"]["value"] == robot.mass
    np.testing.assert_allclose([r["frame anchor"] for r in rows_of(facts["cables"])], robot.a)
