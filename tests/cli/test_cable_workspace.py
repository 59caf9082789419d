"""robocal cable workspace: what it writes agrees with itself, and what is refused or not trusted."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest
from cli.runs import files, robocal

from robocal.cables.workspace import Demand, holds
from robocal.files.cable.cable_robot import read_cable
from robocal.report.sections import figure

PUBLISHED = Path(__file__).parents[2] / "examples" / "cable-published"
ROBOT = (PUBLISHED / "ipanema-1.yaml").read_text()
EVERY = {"workspace.json", "workspace.csv", "outlines.csv", "report.html", "surface.ply", "surface.stl"}
QUICK = ("--cells", 15, "--rays", 600)
# Four cables that hold a platform of fixed orientation in two places apart from each other.
APART = """robocal: 1
name: apart
kind: cable
units: {length: mm, force: kN}
degrees: 1R2T
frame_anchors: [[900, 0, 1400], [1500, 0, 700], [-1300, 0, 2200], [0, 0, 2300]]
platform_anchors: [[600, 0, 300], [-500, 0, 0], [100, 0, -100], [500, 0, 100]]
every_cable: {tension: [0.001, 0.3]}
platform: {mass: 5}
"""


@pytest.fixture
def robot(tmp_path):
    place = tmp_path / "robot.yaml"
    place.write_text(ROBOT)
    return place


def rows(path):
    found = list(csv.reader(io.StringIO(path.read_text())))
    return found[0], np.array([[float(c) if c else np.nan for c in row] for row in found[1:]])


def test_the_files_say_one_thing(robot, tmp_path):
    out = tmp_path / "out"
    ran = robocal("cable", "workspace", robot, "--cells", 21, "--rays", 2000, "-o", out, "--json")
    assert ran.status == 0 and ran.remarks == "" and files(out) == EVERY
    found = json.loads((out / "workspace.json").read_text())
    assert {k: v for k, v in ran.document.items() if k not in ("written", "provenance")} == {
        k: v for k, v in found.items() if k != "provenance"
    }
    grid, rays = found["grid"], found["rays"]
    header, cells = rows(out / "workspace.csv")
    even = ["tension factor", "condition number"]
    assert (
        header == ["x [m]", "y [m]", "z [m]", "held", "margin [N]", "acceleration [m/s2]", *even]
        and len(cells) == 21**3
    )
    held = cells[:, 3] == 1
    box = np.array(grid["sides"])
    assert held.sum() == grid["held"] and grid["size"]["value"] == pytest.approx(
        held.mean() * np.prod(np.ptp(box, axis=1))
    )
    assert found["margin"].pop("unit") == "N" and found["margin"] == pytest.approx(
        {"least": cells[held, 4].min(), "median": np.median(cells[held, 4]), "greatest": cells[held, 4].max()}, rel=1e-6
    )
    assert ((cells[:, 4] >= 0) == held).all() and (np.isfinite(cells[:, 5]) == held).all()
    file = read_cable(robot)
    assert (holds(file.robot, Demand(np.array([25.0])), cells[:, :3]) == held).all()
    # The mesh encloses the volume, the outlines the areas.
    head, _, body = (out / "surface.ply").read_text().partition("end_header\n")
    count = int(head.split("element vertex ")[1].split()[0])
    lines = body.splitlines()
    points, faces = (np.array([line.split() for line in part], float) for part in (lines[:count], lines[count:]))
    corner = points[faces[:, 1:].astype(int)]
    assert rays["size"]["value"] == pytest.approx(np.linalg.det(corner).sum() / 6, rel=1e-6) and rays["why"] == "X_0"
    assert len((out / "surface.stl").read_bytes()) == 84 + 50 * len(faces)
    names = [line.split(",")[0] for line in (out / "outlines.csv").read_text().splitlines()[1:]]
    assert set(names) == {"xy", "xz", "yz"} == set(found["sections"])
    page = (out / "report.html").read_text()
    assert (
        figure(rays["size"]["value"]) in page
        and figure(found["grid"]["size"]["value"]) in page
        and "Section yz" in page
        and page.count("<svg") == 4
        and "nan" not in page.lower().split("<svg")[0]
    )


@pytest.mark.slow
def test_what_is_demanded_makes_it_smaller(robot):
    def volume(*more):
        ran = robocal("cable", "workspace", robot, "--cells", 11, "--rays", 50, "--json", *more)
        assert ran.status == 0, ran.err
        return ran.document["grid"]["size"]["value"], ran.document["demand"]

    plain, demand = volume()
    assert demand["masses"]["value"] == [25.0]
    for more, check in (
        (("--payload", "0,10"), lambda d: d["masses"]["value"] == [25.0, 35.0]),
        (("--mass", "20,60", "--payload", "5"), lambda d: d["masses"]["value"] == [25.0, 65.0]),
        (
            ("--wrench", "0,0,0,0,0,0", "--wrench", "60,0,0,0,0,0"),
            lambda d: d["wrenches"]["values"][1] == [60.0, 0, 0, 0, 0, 0],
        ),
        (
            ("--orientation", "0,0,0", "--orientation", "0,0,5"),
            lambda d: d["orientations"]["value"][1][2] == pytest.approx(np.radians(5)),
        ),
        (("--tilt", "4"), lambda d: len(d["orientations"]["value"]) == 17),
        (("--acceleration", "1"), lambda d: d["acceleration"]["value"] == 1.0),
        (("--reserve", "3"), lambda d: d["reserve"]["value"] == 3.0),
        (("--limits", "7.2,400"), lambda d: d["limits"]["value"][0] == [7.2, 400.0]),
    ):
        size, demand = volume(*more)
        assert 0 < size < plain and check(demand), (more, size, plain)
    # A range of payloads asks for no more than its ends do.
    assert volume("--mass", "25,35")[0] == volume("--payload", "0,10")[0]


def test_a_suspended_robot_starts_in_the_middle(tmp_path):
    ran = robocal("cable", "workspace", PUBLISHED / "cogiro.yaml", *QUICK, "--json")
    found = ran.document
    assert ran.status == 0 and not found["home"]["held"] and found["home"]["margin"]["value"] < 0
    assert "X_0 is not held" in found["rays"]["why"] and found["reaches_box"] == ["z-"]
    assert found["rays"]["seen_share"] > 0.99


def test_a_planar_robot_in_two_parts(tmp_path):
    (tmp_path / "robot.yaml").write_text(APART)
    out = tmp_path / "out"
    ran = robocal("cable", "workspace", tmp_path / "robot.yaml", "--cells", 61, "-o", out, "--json")
    found = ran.document
    assert ran.status == 0 and files(out) == EVERY - {"surface.ply", "surface.stl"}
    assert set(found["sections"]) == {"xz"} and found["grid"]["size"]["unit"] == "m2"
    parts = found["parts"]["value"]
    assert len(parts) == 2 and sum(parts) == pytest.approx(found["grid"]["size"]["value"])
    assert "2 parts that do not touch" in ran.err and "do not reach" in ran.err and "differ by" in ran.err
    assert found["rays"]["seen_share"] < parts[0] / sum(parts) + 1e-9
    header, cells = rows(out / "workspace.csv")
    assert header[:5] == ["x [mm]", "y [mm]", "z [mm]", "held", "margin [kN]"] and np.nanmax(np.abs(cells[:, 4])) < 1
    # Started in the other part, the rays find that one.
    other = cells[(cells[:, 3] == 1)]
    here = np.array(found["rays"]["start"]["value"]) * 1e3
    far = other[
        np.argmax(np.where(other[:, 4] > np.median(other[:, 4]), np.linalg.norm(other[:, :3] - here, axis=1), 0)), :3
    ]
    again = robocal(
        "cable", "workspace", tmp_path / "robot.yaml", "--cells", 61, "--start", ",".join(map(str, far)), "--json"
    ).document
    assert (
        again["rays"]["why"] == "--start"
        and found["rays"]["size"]["value"] + again["rays"]["size"]["value"] < sum(parts) * 1.02
    )


def test_nothing_is_held(robot, tmp_path):
    out = tmp_path / "out"
    ran = robocal("cable", "workspace", robot, *QUICK, "--mass", "2000", "-o", out)
    assert ran.status == 3 and "no cell of the grid can be held: the nearest to it" in " ".join(ran.out.split())
    assert files(out) == {"workspace.json", "workspace.csv", "report.html"}
    found = json.loads((out / "workspace.json").read_text())
    assert found["verdict"]["status"] == "empty" and found["rays"] is None and found["grid"]["size"]["value"] == 0
    # How much is lacking is a lower bound of what is.
    short = -max(v for v in rows(out / "workspace.csv")[1][:, 4])
    assert 0 < short < 2000 * 9.80665


def test_a_grid_too_coarse_for_what_the_rays_find(robot, tmp_path):
    ran = robocal(
        "cable",
        "workspace",
        robot,
        "--box=-100,-100,0,100,100,100",
        "--cells",
        2,
        "--rays",
        500,
        "-o",
        tmp_path / "out",
        "--json",
    )
    found = ran.document
    assert ran.status == 3 and "but the start of the rays can" in ran.err and found["verdict"]["status"] == "found"
    assert found["grid"]["held"] == 0 and found["rays"]["difference"] is None and found["rays"]["size"]["value"] > 5
    assert "surface.stl" in files(tmp_path / "out") and found["extent"] is None


def test_a_box_that_leaves_x_0_out(robot):
    ran = robocal("cable", "workspace", robot, *QUICK, "--box", "0.5,0.3,0.5,1,0.9,1", "--json")
    found = ran.document
    assert "X_0 lies outside the box" in found["rays"]["why"] and found["home"]["held"]
    # All of the box; the rays' triangles cut its corners.
    assert found["grid"]["size"]["value"] == pytest.approx(0.5 * 0.6 * 0.5)
    assert found["rays"]["size"]["value"] == pytest.approx(0.5 * 0.6 * 0.5, rel=0.02)
    assert found["reaches_box"] == ["x-", "x+", "y-", "y+", "z-", "z+"] and found["grid"][
        "share_of_box"
    ] == pytest.approx(1)


def test_singular_poses_are_no_workspace(tmp_path):
    """A platform that is a small frame: where its cables balance the weight they balance nothing else."""
    text = ROBOT.split("platform_anchors")[0] + "platform_anchors:\n"
    corners = [(x, y, z) for z in (0.1, -0.1) for x, y in ((-2, 1.5), (2, 1.5), (2, -1.5), (-2, -1.5))]
    text += "".join(f"  B{i}: [{x / 20}, {y / 20}, {z}]\n" for i, (x, y, z) in enumerate(corners, 1))
    (tmp_path / "robot.yaml").write_text(text + "every_cable: {tension: [5, 500]}\nplatform: {mass: 10}\n")
    ran = robocal("cable", "workspace", tmp_path / "robot.yaml", *QUICK, "--json")
    assert ran.status == 3 and "every feasible cell is a singular pose" in ran.err


def test_an_existing_folder_is_left_alone(robot, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "surface.stl").write_text("mine")
    robocal("cable", "workspace", robot, *QUICK, "-o", tmp_path / "out").assert_refused("surface.stl", "--force")
    assert files(tmp_path / "out") == {"surface.stl"}
    assert robocal("cable", "workspace", robot, *QUICK, "-o", tmp_path / "out", "--force").status == 0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--box", "1,0,0,-1,1,1"), ("--box", "inverted", "X0 < X1")),
        (("--box", "0,0,0,1,1"), ("--box", "X0,Y0,Z0,X1,Y1,Z1")),
        (("--start", "0,0,9"), ("--start", "outside the box")),
        (("--start", "1.9,1.4,1.9"), ("--start", "cannot be held")),
        (("--payload", "5,1"), ("--payload", "rises")),
        (("--mass=-1",), ("--mass", "0 or more")),
        (("--tilt", "0"), ("--tilt", "above 0")),
        (("--acceleration", "nan"), ("--acceleration", "finite")),
        (("--reserve=-1",), ("--reserve", "0 or more")),
        (("--orientation", "1,2"), ("--orientation", "RX,RY,RZ")),
        (("--length", "0"), ("--length", "above 0")),
    ],
)
def test_options_that_make_no_sense(robot, tmp_path, options, words):
    robocal("cable", "workspace", robot, *options, "-o", tmp_path / "out").assert_refused(*words)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('  mass: {value: 25, source: "CASPR, IPAnema_1_bodies.xml"}\n', "", ("robot.yaml", "platform.mass")),
        ("every_cable", "# every_cable", ("robot.yaml", "every_cable.tension")),
    ],
)
def test_a_robot_that_lacks_what_it_takes(robot, old, new, words):
    assert old in ROBOT
    robot.write_text(ROBOT.replace(old, new))
    robocal("cable", "workspace", robot).assert_refused(*words)


def test_robots_that_cannot(tmp_path):
    place = tmp_path / "robot.yaml"
    place.write_text(APART)
    robocal("cable", "workspace", place, "--orientation", "0,0,5").assert_refused("--orientation", "1R2T in xz")
    robocal("cable", "workspace", place, "--box", "-1,-1,0,1,1,1").assert_refused("--box", "Y0 = Y1")
    three = ROBOT.split("frame_anchors")[0].replace("kind: cable", "kind: cable\ndegrees: 3R3T")
    three += (
        "frame_anchors: [[0, 0, 3], [2, 0, 3], [1, 2, 3]]\nplatform_anchors: [[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]]\n"
    )
    place.write_text(three + "every_cable: {tension: [1, 100]}\nplatform: {mass: 3}\n")
    robocal("cable", "workspace", place).assert_refused("robot.yaml", "fewer cables than degrees of freedom")


TRIANGLE = """robocal: 1
name: triangle
kind: cable
units: {length: mm, angle: deg}
degrees: 2T
plane: xz
frame_anchors: [[-2000, 0, 0], [3000, 0, 1000], [500, 0, 4000]]
platform_anchors: [[0, 0, 0], [0, 0, 0], [0, 0, 0]]
"""


def test_closure_asks_for_neither_mass_nor_limits(tmp_path):
    """A point on three cables: its triangle, 8.75 m2, to within what 600 rays leave of its corners."""
    (tmp_path / "robot.yaml").write_text(TRIANGLE)
    out = tmp_path / "out"
    ran = robocal(
        "cable", "workspace", tmp_path / "robot.yaml", "--closure", *QUICK, "--cells", 60, "-o", out, "--json"
    )
    found = ran.document
    assert ran.status == 0 and found["rays"]["size"]["value"] == pytest.approx(8.75, rel=0.01)
    assert found["grid"]["size"]["value"] == pytest.approx(8.75, rel=0.03)
    assert found["margin"] is None and found["acceleration"] is None and found["closed_share"] == 1
    assert 0 < found["tension_factor"]["least"] < 0.1 and 0.9 < found["tension_factor"]["greatest"] <= 1
    assert 1 <= found["condition"]["least"] < 1.05 and found["best"]["margin"] is None
    header, cells = rows(out / "workspace.csv")
    held, factor = cells[:, 3] == 1, cells[:, header.index("tension factor")]
    assert np.isnan(cells[:, header.index("margin [N]")]).all() and (np.isfinite(factor) == held).all()
    page = (out / "report.html").read_text()
    assert "Tension factors in the plane xz" in page and "margin, N" not in page and "not held" not in page
    told = robocal("cable", "workspace", tmp_path / "robot.yaml", "--closure", *QUICK).said
    assert "any wrench (closure)" in told and "greatest tension factor" in told
    assert found["reaches_box"] == [] and "moments" not in told


def test_dexterity_stands_beside_margins(robot):
    ran = robocal("cable", "workspace", robot, *QUICK, "--json")
    found = ran.document
    assert found["margin"]["least"] >= 0 and found["tension_factor"]["least"] >= 0 and found["closed_share"] > 0.5
    shorter = robocal("cable", "workspace", robot, *QUICK, "--length", 0.1, "--json").document
    assert shorter["tension_factor"] == found["tension_factor"] and shorter["condition"] != found["condition"]
    told = robocal("cable", "workspace", robot, *QUICK).said
    assert "tension factor: " in told and "condition number: " in told and "(moments over 1 m)" in told


def test_a_platform_that_hangs_is_closed_nowhere(tmp_path):
    (tmp_path / "robot.yaml").write_text(
        TRIANGLE.replace("[-2000, 0, 0]", "[-2000, 0, 4000]").replace("1000]", "4000]")
    )
    ran = robocal("cable", "workspace", tmp_path / "robot.yaml", "--closure", *QUICK, "-o", tmp_path / "out", "--json")
    assert ran.status == 3 and ran.document["verdict"]["status"] == "empty" and "needs its weight" in ran.remarks
    assert ran.document["tension_factor"] is None and (tmp_path / "out" / "report.html").exists()


@pytest.mark.parametrize("option", ["mass", "payload", "wrench", "acceleration", "reserve", "limits"])
def test_closure_takes_no_demand(robot, option):
    value = {"wrench": "1,0,0,0,0,0", "limits": "1,2"}.get(option, "1")
    ran = robocal("cable", "workspace", robot, "--closure", f"--{option}", value)
    assert ran.status == 2 and f"--{option}" in ran.remarks and "has no effect" in ran.remarks


def test_closure_takes_a_cable_more(tmp_path):
    anchors = "[[0, 0, 0], [0, 0, 0], [0, 0, 0]]"
    text = TRIANGLE.replace("2T", "1R2T").replace(anchors, "[[-100, 0, 0], [100, 0, 0], [0, 0, 100]]")
    (tmp_path / "robot.yaml").write_text(text)
    ran = robocal("cable", "workspace", tmp_path / "robot.yaml", "--closure")
    assert ran.status == 2 and "never all" in ran.remarks and "robot.yaml" in ran.remarks
