"""What is wrong with a cable robot's file or list: every verb says it in one line that names file, row and key, with exit
status 2, and writes nothing."""

from __future__ import annotations

import re

import numpy as np
import pytest
from cables.cable_robots import box
from cli.runs import files, robocal
from listings import rows_of

from robocal.files.cable.write import describe_cable

VERBS = ("inverse", "forward", "tension")
WITHOUT_LIST = ("workspace", "poses")
POSES = """id,x [mm],y [mm],z [mm],rx [deg],ry [deg],rz [deg]
low,100,-200,900,0,0,0
high,300,200,1600,5,3,-10
"""
ROBOT = describe_cable(box()) + (
    "platform: {mass: 12}\nevery_cable: {tension: [10, 400], elasticity: 2.5e-5, density: 0.3}\n"
)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "robot.yaml").write_text(ROBOT)
    (tmp_path / "poses.csv").write_text(POSES)
    (tmp_path / "lengths.csv").write_text(
        robocal("cable", "inverse", tmp_path / "robot.yaml", tmp_path / "poses.csv").out
    )
    return tmp_path


def run(folder, verb, *more):
    """The verb on robot.yaml and its list, writing to out."""
    rows = folder / ("lengths.csv" if verb == "forward" else "poses.csv")
    return robocal("cable", verb, folder / "robot.yaml", rows, "-o", folder / "out", *more)


def alone(folder, verb):
    """A verb that takes no list."""
    return robocal("cable", verb, folder / "robot.yaml", "-o", folder / "out")


def swapped(old, new, count=0):
    assert old in ROBOT
    return ROBOT.replace(old, new) if not count else ROBOT.replace(old, new, count)


def without(*words):
    return "".join(line for line in ROBOT.splitlines(keepends=True) if not any(w in line for w in words))


def cables(text):
    """Without the list of cables."""
    return "".join(line for line in text.splitlines(keepends=True) if "name: c" not in line and line != "cables:\n")


FILES = {
    "seven frame anchors": (without("A8:"), ["cables[7].frame", "no such frame anchor", "A8"]),
    "seven anchors of both": (without("A8:", "B8:"), ["cables[7].frame", "no such frame anchor"]),
    "seven, nothing joined": (cables(without("A8:")), ["frame_anchors", "7 frame anchors, 8 platform anchors"]),
    "eight, nine joined": (
        ROBOT.replace("platform: {mass", "  - {name: c9}\nplatform: {mass"), ["cables[8]", "cable 9 has no frame anchor"]
    ),
    "two cables": (
        without(*(f"{w}{i}" for w in ("A", "B", "name: c") for i in range(3, 9))), ["cables", "3 to 12 cables", "found 2"]
    ),
    "one cable twice": (swapped("frame: A2, platform: B2", "frame: A1, platform: B1"), ["cables[1]", "are the same"]),
    "one name twice": (swapped("name: c2", "name: c1"), ["cables[1].name", "given twice"]),
    "frame in one point": (re.sub(r"(A\d: )\[.*\]", r"\1[1, 1, 2]", ROBOT), ["cannot hold the platform", "3 directions"]),
    "platform in one point": (re.sub(r"(B\d: )\[.*\]", r"\1[0, 0, 0]", ROBOT), ["platform_anchors", "3 directions"]),
    "platform in a line": (re.sub(r"(B\d: )\[([-.\d]+).*\]", r"\1[\2, 0, 0]", ROBOT), ["platform_anchors", "5 directions"]),
    "always slack": (swapped("[10, 400]", "[0, 0]"), ["every_cable.tension", "always slack", "found [0.0, 0.0]"]),
    "pushing": (swapped("[10, 400]", "[-10, 400]"), ["every_cable.tension", "cannot push", "found -10.0"]),
    "crossed": (swapped("[10, 400]", "[400, 10]"), ["every_cable.tension", "crossed", "found [400.0, 10.0]"]),
    "crossed once": (swapped("name: c3,", "name: c3, tension: [9, 2],"), ["cables[2].tension", "crossed"]),
    "unlimited": (swapped("[10, 400]", "[10, .inf]"), ["every_cable.tension[1]", "finite number in N"]),
    "one limit": (swapped("[10, 400]", "400"), ["every_cable.tension", "a list of 2 numbers"]),
    "limits of one cable": (
        swapped("tension: [10, 400], ", "").replace("name: c1,", "name: c1, tension: [1, 2],"),
        ["cables[1]", "for some cables only", "c2, c3"],
    ),
    "no weight": (swapped("mass: 12", "mass: 0"), ["platform.mass", "a platform has a mass"]),
    "heavy": (swapped("mass: 12", "mass: heavy"), ["platform.mass", "a finite number in kg"]),
    "a flat centre": (swapped("mass: 12", "mass: 12, centre_of_mass: [0, 0]"), ["platform.centre_of_mass", "3 numbers"]),
    "no body": (swapped("mass: 12", "mass: 12, inertia: [[1, 0, 0], [0, 1, 0], [0, 0, 9]]"), ["platform.inertia", "no body"]),
    "elastic": (swapped("2.5e-5", "-2.5e-5"), ["every_cable.elasticity", "negative elasticity"]),
    "inside out": (swapped("density: 0.3", "density: 0.3, pulley: {radius: -1, axis: [0, 0, 1]}"), ["pulley", "negative radius"]),
    "no axis": (swapped("density: 0.3", "density: 0.3, pulley: {radius: 0.1, axis: [0, 0, 0]}"), ["pulley.axis", "direction"]),
    "a pulley in metres": (
        swapped("density: 0.3", "density: 0.3, pulley: {radius: 50, axis: [0, 0, 1]}"), ["every_cable.pulley", "so large"]
    ),
    "kilograms of force": (swapped("force: N", "force: kg"), ["units.force", "a force is needed"]),
    "five degrees": (swapped("3R3T", "2R3T"), ["degrees", "did you mean '3R3T'"]),
    "a slip of the pen": (swapped("{tension", "{tensoin"), ["every_cable.tensoin", "did you mean 'tension'"]),
    "no number": (swapped("A1: [2.5,", "A1: [.nan,"), ["frame_anchors.A1[0]", "not a finite number"]),
    "no anchors": (without("A1", "A2", "A3", "A4", "A5", "A6", "A7", "A8:"), ["frame_anchors", "not a list or mapping"]),
    "nobody joined": ("".join(line for line in ROBOT.splitlines(keepends=True) if "name: c" not in line).replace(
        "cables:\n", "cables: []\n"), ["cables", "found 0"]),
    "key twice": (ROBOT + "platform: {mass: 3}\n", ["platform", "given twice"]),
    "only a kind": ("robocal: 1\nkind: cable\n", ["name", "missing"]),
    "a list": ("- 1\n- 2\n", ["not a mapping"]),
    "no YAML": ("robocal:\t1\n  x: [", ["not valid YAML"]),
    "broken XML": ("<cables><cable>", ["not valid XML"]),
    "XML of nothing": ("<cables></cables>", ["X_cables.xml"]),
}  # fmt: skip


@pytest.mark.parametrize("wrong", FILES)
def test_robot_files(folder, wrong):
    text, words = FILES[wrong]
    (folder / "robot.yaml").write_text(text)
    before = files(folder)
    every = (*VERBS, *WITHOUT_LIST)
    at = list(FILES).index(wrong)
    for verb in (every[at % 5], every[(at + 2) % 5]):  # they share the reader: two of five are enough for each
        ran = run(folder, verb) if verb in VERBS else alone(folder, verb)
        ran.assert_refused("robot.yaml", *words)
    assert files(folder) == before and not (folder / "out").exists()


@pytest.mark.parametrize(
    ("gone", "words"),
    [("mass: 12", ["platform.mass", "mass of box is not known"]), ("tension: [10, 400], ", ["tension", "not known"])],
)
def test_what_is_not_known_is_asked_for(folder, gone, words):
    """Lengths need neither mass nor limits; whatever holds the platform needs both."""
    (folder / "robot.yaml").write_text(swapped(gone, ""))
    assert run(folder, "inverse").status == run(folder, "forward", "--force").status == 0
    (folder / "out").unlink()
    run(folder, "tension").assert_refused("robot.yaml", *words)
    for verb in WITHOUT_LIST:
        alone(folder, verb).assert_refused("robot.yaml", *words)
    assert not (folder / "out").exists()


def test_anchors_that_coincide_at_the_frame_only_are_remarked_on(folder):
    (folder / "robot.yaml").write_text(swapped("A2: [-2.5, 2, 0.1]", "A2: [2.5, 2, 0.1]"))
    ran = run(folder, "inverse")
    assert ran.status == 0 and "cables c1 and c2 leave the frame at the same point" in ran.err


LISTS = {
    "header only": (POSES.splitlines()[0] + "\n", ["no rows"]),
    "nothing": ("", ["empty"]),
    "no number": (POSES.replace("100,", "nan,"), ["row 2", "column x", "not a finite number"]),
    "endless": (POSES.replace("100,", "inf,"), ["row 2", "column x", "not a finite number"]),
    "short": (POSES.replace("high,300,200,1600,5,3,-10", "high,300"), ["row 3", "wrong number of columns"]),
    "one name twice": (POSES.replace("high", "low"), ["row 3", "column id", "two rows have one name"]),
    "no name": (POSES.replace("high", ""), ["row 3", "column id", "empty"]),
    "one column twice": (POSES.replace("y [mm]", "x [mm]"), ["column x", "several columns"]),
    "an angle for a length": (POSES.replace("x [mm]", "x [deg]"), ["column x", "a length is needed"]),
    "tension of one cable": (
        POSES.replace("rz [deg]", "rz [deg],c1.tension [N]")
        .replace("0,0,0\n", "0,0,0,5\n")
        .replace("-10\n", "-10,4\n"),
        ["column c2.tension", "no such column"],
    ),
    "out of all frames": (POSES.replace("100,", "1e20,"), ["row 2", "column x", "so far away", "within"]),
    "three of a quaternion": (POSES.replace("rx [deg],ry [deg],rz [deg]", "qx,qy,qz"), ["column qw", "no such column"]),
    "two orientations": (
        "".join(
            f"{line},{more}\n"
            for line, more in zip(POSES.splitlines(), ("qx,qy,qz,qw", "0,0,0,1", "0,0,0,1"), strict=True)
        ),
        ["column qx", "the orientation is given twice"],
    ),
    "no text": ("\x00\x01\x02", ["row 1", "a byte 0"]),
}


@pytest.mark.parametrize("wrong", LISTS)
def test_lists(folder, wrong):
    text, words = LISTS[wrong]
    (folder / "poses.csv").write_text(text)
    for verb in ("inverse", "tension"):
        run(folder, verb).assert_refused("poses.csv", *words)
        assert "data file" not in run(folder, verb).said, "a list has none"
    assert not (folder / "out").exists()


def test_no_length_whatever_the_model(folder):
    """A platform anchor on its frame anchor: the row of the list is named."""
    at = ",".join(f"{v:.9g}" for v in (box().a[2] - box().b[2]) * 1000)
    (folder / "poses.csv").write_text(POSES + f"touching,{at},0,0,0\n")
    for more in ((), ("--tension", "50"), ("--tension", "50", "--sag")):
        run(folder, "inverse", *more).assert_refused("poses.csv", "row 4", "key c3", "has no length")
    run(folder, "tension").assert_refused("poses.csv", "row 4", "key c3", "touching")


@pytest.mark.parametrize("verb", ["inverse", "forward"])
@pytest.mark.parametrize("tension", ["-4", "nan", "inf"])
def test_tensions_that_are_none(folder, verb, tension):
    run(folder, verb, "--tension", tension).assert_refused("--tension", "cannot push")
    rows = folder / ("lengths.csv" if verb == "forward" else "poses.csv")
    head, first, *rest = rows.read_text().splitlines()
    head += "".join(f",c{i}.tension [N]" for i in range(1, 9))
    listed = [head, first + ",50" * 8, *(row + ",50,50,-3" + ",50" * 5 for row in rest)]
    rows.write_text("\n".join(listed))
    run(folder, verb).assert_refused(rows.name, "row 3", "column c3.tension", "cannot push", "-3")


def test_cables_that_cannot_carry_themselves(folder):
    """One newton cannot hold metres of a cable of 3 N/m: `inverse` refuses the row, `forward` finds nothing and says so."""
    (folder / "robot.yaml").write_text(swapped("density: 0.3", "density: 3"))
    run(folder, "inverse", "--tension", "1", "--sag").assert_refused("poses.csv", "row 2", "does not carry its weight")
    run(folder, "forward", "--tension", "1e-3", "--sag").assert_refused(
        "--tension", "geometric lengths are not stretched"
    )
    shown = folder / "lengths.csv"
    shown.write_text(shown.read_text().replace(".geometric", ""))
    ran = run(folder, "forward", "--tension", "1e-3", "--sag", "--json")
    assert ran.status == 3 and "low: no pose was found at which the cables can hang with these lengths" in ran.err
    poses = rows_of(ran.document["poses"])
    assert all(p["residual"] is None and not p["converged"] and p["solutions"] <= 1 for p in poses)


@pytest.mark.parametrize("value", ["-0", "-5", "1e9", "1e29"])
def test_lengths_that_cannot_be(folder, value):
    rows = [line.split(",") for line in (folder / "lengths.csv").read_text().splitlines()]
    rows[1][1] = value
    (folder / "lengths.csv").write_text("\n".join(map(",".join, rows)))
    ran = run(folder, "forward")
    assert ran.status == 3 and "warning: low: " in ran.err and "high" not in ran.err and "Traceback" not in ran.err


def test_arguments_that_are_mixed_up_or_not_there(folder):
    for verb in VERBS:
        robocal("cable", verb, folder, folder / "poses.csv").assert_refused("this is a folder")
        robocal("cable", verb, folder / "robt.yaml", folder / "poses.csv").assert_refused("did you mean 'robot.yaml'")
        robocal("cable", verb, folder / "robot.yaml", folder / "pose.csv").assert_refused("did you mean 'poses.csv'")
        robocal("cable", verb, folder / "poses.csv", folder / "robot.yaml").assert_refused("poses.csv")


def test_of_a_run_the_file_of_its_robot_is_named(folder):
    (folder / "run").mkdir()
    (folder / "run" / "calibrated.yaml").write_text((folder / "robot.yaml").read_text())
    ran = robocal("cable", "inverse", folder / "run", folder / "poses.csv")
    assert ran.status == 2 and "this is a folder" in ran.remarks and "calibrated.yaml" in ran.remarks


def test_errors_are_documents_too(folder):
    (folder / "robot.yaml").write_text(FILES["crossed"][0])
    for verb in VERBS:
        told = run(folder, verb, "--json").document["error"]
        assert told["file"].endswith("robot.yaml") and told["key"] == "every_cable.tension"
        assert told["row"] == len(ROBOT.splitlines()) and told["found"] == [400.0, 10.0]


def test_the_list_that_is_refused_is_not_what_is_wrong(folder):
    """The rows above are right: all three verbs take them, and the numbers go round."""
    for verb in VERBS:
        assert run(folder, verb, "--force").status == 0
        out = folder / "out"
        if verb == "forward":
            found = [[float(c) for c in row.split(",")[1:7]] for row in out.read_text().splitlines()[1:]]
            np.testing.assert_allclose(found, [[0.1, -0.2, 0.9, 0, 0, 0], [0.3, 0.2, 1.6, 5, 3, -10]], atol=1e-8)
        if out.is_file():
            out.unlink()
