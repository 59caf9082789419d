"""Figures 3.3 to 3.5 of the thesis on the Laval robot, by the commands of the example: what they claim, on a robot whose missing
numbers are assumed (the figures print none)."""

from __future__ import annotations

import csv
import json
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from cli.runs import robocal
from listings import rows_of

from robocal.cables.interference import distances
from robocal.cables.workspace import Demand, holds
from robocal.files.cable.cable_robot import read_cable
from robocal.geometry import se3, so3

LAVAL = Path(__file__).parents[2] / "examples" / "cable-laval"


@pytest.fixture(scope="module")
def workspace(tmp_path_factory):
    folder = tmp_path_factory.mktemp("figures") / "workspace"
    ran = robocal("cable", "workspace", LAVAL / "robot.yaml", "--rays", 2000, "--cells", 20, "-o", folder)
    assert ran.status == 0, ran.said
    return folder


@pytest.fixture(scope="module")
def robot():
    return read_cable(LAVAL / "robot.yaml").robot


def at(robot, points):
    return holds(
        robot, Demand(np.array([robot.mass])), se3.compose(np.broadcast_to(np.eye(3), (len(points), 3, 3)), points)
    )


def cells(folder):
    rows = list(csv.DictReader((folder / "workspace.csv").read_text().splitlines()))
    keys = list(rows[0])
    places = np.array([[float(r[k]) for k in keys[:3]] for r in rows]) * 1e-3
    return places, np.array([r["held"] in ("1", "true", "yes") for r in rows])


def test_figure_3_3_rays_and_grid_find_one_workspace(workspace, robot):
    told = json.loads((workspace / "workspace.json").read_text())
    grid, rays = told["grid"]["size"]["value"], told["rays"]["size"]["value"]
    assert abs(rays / grid - 1) < 0.01
    lines = (workspace / "surface.ply").read_text().splitlines()
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    body = lines.index("end_header") + 1
    vertices = np.array([line.split()[:3] for line in lines[body : body + count]], float)
    assert count >= 2000
    home = robot.home[:3, 3]
    # The boundary is exact: a thousandth within it everything is held, a thousandth beyond it nothing is.
    assert at(robot, home + 0.999 * (vertices - home)).all() and not at(robot, home + 1.001 * (vertices - home)).any()


def test_figure_3_4_three_sections_agree_with_the_grid(workspace, robot):
    """Between the centres of a held cell and of one that is not, side by side, the outline passes: no point of it is more than a cell
    away."""
    places, held = cells(workspace)
    step = np.array([np.diff(np.unique(places[:, i].round(9))).min() for i in range(3)])
    rows = list(csv.DictReader((workspace / "outlines.csv").read_text().splitlines()))
    names = list(rows[0])
    planes = {r[names[0]] for r in rows}
    assert len(planes) == 3
    for plane in planes:
        points = np.array([[float(r[k]) for k in names[-3:]] for r in rows if r[names[0]] == plane]) * 1e-3
        assert len(points) > 100
        for p in points[::7]:
            near = (np.abs(places - p) <= 1.01 * step).all(axis=1)
            assert held[near].any() and not held[near].all(), p


def test_figure_3_5_a_pose_on_the_way(tmp_path, robot):
    ran = robocal("cable", "contact", LAVAL / "robot.yaml", LAVAL / "way.csv", "-o", tmp_path / "way")
    (motion,) = rows_of(json.loads((tmp_path / "way" / "contact.json").read_text())["motions"])
    assert ran.status == 3 and round(motion["free"], 2) == 0.56 and motion["ends by"] == "c2 meets c6"
    # Looked for again at 20 000 places of the way.
    rows = list(csv.DictReader((LAVAL / "way.csv").read_text().splitlines()))
    start, end = (np.array([float(r[k]) for k in list(r)[1:]]) for r in rows)
    share = np.linspace(0, 1, 20_001)
    turn = so3.exp(share[:, None] * np.radians(end[3:]))
    origin = 1e-3 * (start[:3] + share[:, None] * (end - start)[:3])
    ends = origin[:, None] + np.einsum("nij,mj->nmi", turn, robot.b)
    touching = np.full(len(share), False)
    for k, l in combinations(range(8), 2):
        gap = distances(
            np.broadcast_to(robot.a[k], ends[:, k].shape),
            ends[:, k],
            np.broadcast_to(robot.a[l], ends[:, l].shape),
            ends[:, l],
        )
        touching |= gap <= (robot.diameter[k] + robot.diameter[l]) / 2
    assert motion["free"] == pytest.approx(share[touching.argmax()], abs=1e-4)
    here = np.array(motion["T_base_platform"])
    np.testing.assert_allclose(here[:3, 3], 1e-3 * (start[:3] + motion["free"] * (end - start)[:3]), atol=1e-9)
    page = (tmp_path / "way" / "report.html").read_text()
    assert (
        "ends at 0.560 of its way: c2 meets c6" in page
        and 'class="ghost"' in page
        and "2 other platforms in outline" in page
    )
