"""Valid files of cable robots, damaged at random: never a traceback, never more than one error, nothing written when refused;
and tensions that are called feasible hold the platform of the damaged file."""

from __future__ import annotations

import random

import numpy as np
import pytest
from cli.runs import files, robocal
from cli.test_cable_bad_files import POSES, ROBOT, VERBS
from cli.test_mutations import ANY, column

from robocal.files.cable.lists import read_platform_poses
from robocal.files.cable.robot import read_cable

QUICK, MANY, EACH = 1, 24, 20
PLANAR = """robocal: 1
name: flat
kind: cable
units: {length: mm, angle: deg, force: N, mass: kg}
degrees: 1R2T
frame_anchors: [[-2000, 0, 3000], [2000, 0, 3000], [2000, 0, 0], [-2000, 0, 0]]
platform_anchors: [[-75, 0, -43], [75, 0, -43], [75, 0, 43], [-75, 0, 43]]
every_cable: {tension: [10, 100], elasticity: 2.5e-5, density: 0.000122}
platform: {mass: 2, centre_of_mass: [0, 0, 0]}
"""
OVER_PULLEYS = ROBOT.replace("density: 0.3", "density: 0.3, pulley: {radius: 0.05, axis: [0, 0, 1]}")
RIGHT = (
    (ROBOT, POSES),
    (OVER_PULLEYS, POSES),
    (
        PLANAR,
        POSES.replace("100,-200,900,0,0,0", "100,0,1500,0,2,0").replace("300,200,1600,5,3,-10", "-300,0,1200,0,0,0"),
    ),
)
OPTIONS = {
    "inverse": ((), ("--tension", "60"), ("--tension", "60", "--sag")),
    "forward": ((), ("--tension", "60"), ("--tension", "60", "--sag")),
    "tension": ((), ("--method", "mid"), ("--method", "barycentre"), ("--method", "closed"), ("--method", "p-norm")),
}


def damaged(rng, text):
    for _ in range(rng.choice((1, 1, 2))):
        if text.strip() and any(c.isdigit() for c in text):
            try:
                text = rng.choice((*ANY, column))(rng, text)
            except (IndexError, ValueError):  # nothing left of the sort that this one damages
                continue
    return text


def hold(folder, document):
    """Equilibrium of what is called held, over straight cables, written out here; True where any was looked at."""
    robot = read_cable(folder / "robot.yaml").robot
    if robot.pulleys is not None:
        return False
    pose = read_platform_poses(folder / "list.csv", robot).values
    for i, told in enumerate(document["poses"]):
        if told["tension_N"] is None:
            continue
        t = np.array(told["tension_N"])
        lever = robot.b @ pose[i, :3, :3].T
        d = robot.a - pose[i, :3, 3] - lever
        pull = t[:, None] * d / np.linalg.norm(d, axis=1, keepdims=True)
        weight = np.array([0, 0, -9.80665 * (robot.mass or 0.0)])
        arm = pose[i, :3, :3] @ robot.com
        left = np.r_[pull.sum(axis=0) + weight, np.cross(lever, pull).sum(axis=0) + np.cross(arm, weight)]
        size = t.sum() + np.linalg.norm(weight)
        reach = 1 + np.abs(robot.b).max() + np.abs(robot.com).max()
        assert np.abs(left[list(robot.axes)]).max() < 1e-8 * size * reach
        assert (t >= robot.limits[:, 0] - 1e-9 * size).all() and (t <= robot.limits[:, 1] + 1e-9 * size).all()
    return True


def test_what_is_right_is_looked_at(tmp_path):
    """So that `hold` is no empty promise: it passes what is right, and not a tension that is a millionth off."""
    for robot, rows in RIGHT:
        (tmp_path / "robot.yaml").write_text(robot)
        (tmp_path / "list.csv").write_text(rows)
        ran = robocal("cable", "tension", tmp_path / "robot.yaml", tmp_path / "list.csv", "--json")
        document = ran.document
        assert ran.status == 0 and hold(tmp_path, document) == ("pulley" not in robot)
        document["poses"][1]["tension_N"][0] *= 1 + 1e-6
        if "pulley" not in robot:
            with pytest.raises(AssertionError):
                hold(tmp_path, document)


@pytest.mark.parametrize(
    "chunk", [*range(QUICK), *(pytest.param(i, marks=pytest.mark.slow) for i in range(QUICK, MANY))]
)
def test_damaged_files(tmp_path, chunk):
    rng, out = random.Random(chunk), tmp_path / "out"
    seen = set()
    for _ in range(EACH):
        verb = rng.choice(VERBS)
        more = rng.choice(OPTIONS[verb])
        robot, rows = rng.choice(RIGHT)
        (tmp_path / "robot.yaml").write_text(robot)
        (tmp_path / "list.csv").write_text(rows)
        if verb == "forward":
            lengths = robocal("cable", "inverse", tmp_path / "robot.yaml", tmp_path / "list.csv", *more).out
            (tmp_path / "list.csv").write_text(lengths)
            more += ("--starts", "2")
        name = rng.choice(("robot.yaml", "list.csv"))
        text = damaged(rng, (tmp_path / name).read_text())
        (tmp_path / name).write_bytes(text.encode("utf-8", "replace"))
        before = files(tmp_path)
        ran = robocal("cable", verb, tmp_path / "robot.yaml", tmp_path / "list.csv", "--json", *more)
        assert ran.status in (0, 2, 3) and "Traceback" not in ran.err, (verb, more, text, ran.err)
        if ran.status == 2:
            ran.assert_refused()
            robocal("cable", verb, tmp_path / "robot.yaml", tmp_path / "list.csv", *more, "-o", out).assert_refused()
            assert files(tmp_path) == before and not out.exists()
        elif verb == "tension":
            hold(tmp_path, ran.document)
        seen.add(ran.status)
    assert 2 in seen and len(seen) > 1
