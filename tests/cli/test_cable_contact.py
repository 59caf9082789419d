"""A path of one's own: a contact that is known is told at its share, tensions at theirs, and what can be gone is."""

from __future__ import annotations

import csv
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from cables.cable_robots import published
from cables.test_contact_pulleys import tangents
from cli.runs import robocal
from cli.test_cable_identify import table
from listings import rows_of

from robocal.cables.geometry import cable_robot
from robocal.cables.interference import distances
from robocal.cables.pulley import Pulleys
from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.write import describe_cable
from robocal.geometry import so3

LAVAL = Path(__file__).parents[2] / "examples" / "cable-laval" / "robot.yaml"
COLUMNS = ["x [m]", "y [m]", "z [m]", "rx [deg]", "ry [deg]", "rz [deg]"]
THICK = 0.0048  # m, of every cable


@pytest.fixture
def folder(tmp_path):
    """The Laval robot of which neither mass nor tension limits are known."""
    bare = replace(read_cable(LAVAL).robot, mass=None, limits=None, assumed=(), sources={})
    (tmp_path / "bare.yaml").write_text(describe_cable(bare))
    return tmp_path


def path(folder, rows):
    home = read_cable(LAVAL).robot.home[:3, 3]
    at = np.array(rows, float) + np.concatenate([home, np.zeros(3)])
    (folder / "path.csv").write_text(table(COLUMNS, [f"p{i}" for i in range(len(rows))], at))
    return folder / "path.csv"


def distance(a, b, c, d):
    """Of two segments, by the clamped closest points of both on each other, both ways."""
    u, v, w = b - a, d - c, a - c
    uu, uv, vv, uw, vw = u @ u, u @ v, v @ v, u @ w, v @ w
    s = np.clip((uv * vw - vv * uw) / (uu * vv - uv * uv), 0, 1)
    t = np.clip((uv * s + vw) / vv, 0, 1)
    s = np.clip((uv * t - uw) / uu, 0, 1)
    return np.linalg.norm(w + s * u - t * v)


def test_a_known_contact_is_at_its_share(folder):
    """Turned about y the platform brings two cables together: where, found here by looking at every pair at 4000 angles."""
    robot, most = read_cable(LAVAL).robot, np.radians(20)
    shares, first = np.linspace(0, 1, 4001), None
    for share in shares:
        ends = robot.home[:3, 3] + robot.b @ so3.exp(np.array([0, share * most, 0])).T
        near = {(i, j): distance(robot.a[i], ends[i], robot.a[j], ends[j]) for i, j in combinations(range(8), 2)}
        pair = min(near, key=near.get)
        if near[pair] <= THICK:
            first = share, pair
            break
    assert first is not None and 0.02 < first[0] < 0.98
    ran = robocal(
        "cable",
        "contact",
        folder / "bare.yaml",
        path(folder, [[0] * 6, [0, 0, 0, 0, 20, 0]]),
        "--body",
        "none",
        "--json",
    )
    (motion,) = rows_of(ran.document["motions"])
    who = f"{robot.cables[first[1][0]]} meets {robot.cables[first[1][1]]}"
    assert ran.status == 3 and motion["free"] == pytest.approx(first[0], abs=5e-4) and motion["ends by"] == who
    assert "only contacts were checked" in ran.remarks


def test_what_can_be_gone_is(folder):
    rows = [[0] * 6, [0, 0, 0.002, 0, 0, 0], [0.001, 0, 0, 0, 0, 0.1]]
    ran = robocal("cable", "contact", folder / "bare.yaml", path(folder, rows), "-o", folder / "way")
    assert ran.status == 0 and "2 of 2 motions can be gone to their end" in ran.said
    found = list(csv.reader((folder / "way" / "legs.csv").read_text().splitlines()))
    assert found == [["from", "to", "free", "ends by"], ["p0", "p1", "1", ""], ["p1", "p2", "1", ""]]
    page = (folder / "way" / "report.html").read_text()
    assert "From p1 to p2" in page and "can be gone to its end" in page and "From p0 to p1" not in page
    again = robocal("cable", "contact", folder / "bare.yaml", folder / "path.csv", "-o", folder / "way")
    assert again.status == 2 and "legs.csv" in again.remarks


def test_tensions_end_a_motion(tmp_path):
    """Two cables of at most 20 N hold 1 kg from above as long as 2 T sin >= m g, half a metre below their anchors; the third, from below,
    does not help."""
    a = np.array([(-2.0, 0, 3), (2, 0, 3), (0, 0, 0)])
    limits = np.tile([0.0, 20.0], (3, 1))
    robot = cable_robot("flat", a, np.zeros((3, 3)), mass=1.0, limits=limits, degrees="2T", plane="xz")
    (tmp_path / "flat.yaml").write_text(describe_cable(robot))
    rows = np.array([[0, 0, 1.0, 0, 0, 0], [0, 0, 2.9, 0, 0, 0]])
    (tmp_path / "up.csv").write_text(table(COLUMNS, ["low", "high"], rows))
    ran = robocal("cable", "contact", tmp_path / "flat.yaml", tmp_path / "up.csv", "--body", "none", "--json")
    (motion,) = rows_of(ran.document["motions"])
    sine = 9.80665 / (2 * 20.0)
    share = (3 - 2 * sine / np.sqrt(1 - sine**2) - 1) / 1.9
    assert (
        ran.status == 3
        and motion["free"] == pytest.approx(share, abs=1e-9)
        and motion["ends by"] == "the tension limits"
    )


def test_what_cable_poses_lists_can_be_gone(tmp_path):
    made = robocal("cable", "poses", LAVAL, "-n", 8, "--json").document
    home = published("laval").home[:3, 3]
    for pose in rows_of(made["poses"]):
        t = np.array(pose["T_base_platform"])
        w = np.degrees(so3.log(t[:3, :3]))
        rows = np.array([[*home, 0, 0, 0], [*t[:3, 3], *w]])
        (tmp_path / "way.csv").write_text(table(COLUMNS, ["start", "end"], rows))
        ran = robocal("cable", "contact", LAVAL, tmp_path / "way.csv")
        assert ran.status == 0, ran.said


@pytest.mark.parametrize(
    ("rows", "words"), [([[0] * 6], "two poses or more"), ([[0] * 6, [0, np.nan, 0, 0, 0, 0]], "path.csv, row 3")]
)
def test_what_is_no_path(folder, rows, words):
    ran = robocal("cable", "contact", folder / "bare.yaml", path(folder, rows))
    assert ran.status == 2 and words in ran.remarks, ran.said


def test_over_pulleys_a_contact_is_where_the_cables_lie(folder):
    """Wheels of 80 mm move the contact; where, found here with tangents drawn by trigonometry at 4000 angles."""
    robot, most, r = read_cable(LAVAL).robot, np.radians(20), 0.08
    axis = np.where(robot.a[:, 2:] > robot.home[2, 3], [0.0, 0, -1], [0.0, 0, 1])
    over = robot.having(
        pulleys=Pulleys(np.full(8, r), axis), mass=None, limits=None, density=None, assumed=(), sources={}
    )
    (folder / "wheels.yaml").write_text(describe_cable(over))
    shares = np.linspace(0, 1, 4001)
    turn = so3.exp(np.stack([0 * shares, shares * most, 0 * shares], axis=-1))
    ends = robot.home[:3, 3] + np.einsum("nij,kj->nki", turn, robot.b)
    near = tangents(robot.a, ends, axis, np.full(8, r))
    pairs = list(combinations(range(8), 2))
    gap = np.array([distances(near[:, k], ends[:, k], near[:, l], ends[:, l]) for k, l in pairs])
    touched = np.flatnonzero((gap <= THICK).any(axis=0))
    assert touched[0] > 0
    k, l = pairs[int(gap[:, touched[0]].argmin())]
    way = path(folder, [[0] * 6, [0, 0, 0, 0, 20, 0]])
    found = []
    for name in ("wheels.yaml", "bare.yaml"):
        ran = robocal("cable", "contact", folder / name, way, "--body", "none", "--json")
        found.append(rows_of(ran.document["motions"])[0])
    assert found[0]["free"] == pytest.approx(shares[touched[0]], abs=5e-4)
    assert found[0]["ends by"] == f"{robot.cables[k]} meets {robot.cables[l]}"
    assert abs(found[0]["free"] - found[1]["free"]) > 10 * 5e-4  # the wheels matter


def test_targets_from_the_first_pose(folder):
    """The way to a target does not lead through the one before: what ends on the path there does not from the start, and a motion that
    ends from there ends where it does alone."""
    rows = [[0] * 6, [0, 0, 0, 0, 20, 0], [0.001, 0, 0.002, 0, 0, 0]]
    way = path(folder, rows)
    alone = rows_of(
        robocal("cable", "contact", folder / "bare.yaml", path(folder, rows[:2]), "--json").document["motions"]
    )[0]
    way = path(folder, rows)
    ran = robocal("cable", "contact", folder / "bare.yaml", way, "--from-first", "-o", folder / "star", "--json")
    assert ran.status == 3
    first, second = rows_of(ran.document["motions"])
    assert first["free"] == alone["free"] < 1 and (second["from"], second["to"], second["free"]) == ("p0", "p2", 1.0)
    chain = rows_of(robocal("cable", "contact", folder / "bare.yaml", way, "--json").document["motions"])[1]
    assert chain["from"] == "p1" and chain["free"] < 1


def test_a_program_is_a_path(tmp_path):
    robocal("cable", "poses", LAVAL, "-n", 5, "-o", tmp_path / "list")
    ran = robocal("cable", "contact", LAVAL, tmp_path / "list" / "program.csv")
    assert ran.status == 0 and "not read" not in ran.said, ran.said


def test_a_search_that_does_not_end_is_said_to_have_given_up(tmp_path):
    """Behind its wheel an anchor passes the swivel axis: the pulley turns over at once, and no contact is claimed there."""
    over = Pulleys(np.full(3, 0.05), np.tile([0.0, 0, 1], (3, 1)))
    a, b = [[0, 0, 3], [2, 2, 3], [-2, 2, 3]], [[0, 0, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]]
    (tmp_path / "robot.yaml").write_text(describe_cable(cable_robot("turning over", a, b, degrees="3T", pulleys=over)))
    (tmp_path / "path.csv").write_text(table(COLUMNS[:3], ["p0", "p1"], np.array([[-1, 0, 1], [1, 0, 1]])))
    ran = robocal("cable", "contact", tmp_path / "robot.yaml", tmp_path / "path.csv", "--body", "none", "--json")
    assert ran.status == 3 and "the search for contacts stopped" in ran.said
    assert rows_of(ran.document["motions"])[0]["free"] == pytest.approx(0.5, abs=1e-6)
    assert "may meet" in rows_of(ran.document["motions"])[0]["ends by"]
