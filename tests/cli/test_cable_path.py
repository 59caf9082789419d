"""The builder's whole path: from `new cable` to a validated robot and a program without contacts, in ten commands.

The simulated robot has drums that err by a per cent, zeros that nobody knows, and a tracker that stands anywhere.
"""

from __future__ import annotations

import json
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from cables.virtual_cell import HEADER, LENGTH, Cell, write
from cli.runs import robocal

from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.pose_lists import read_platform_poses
from robocal.geometry import fits, se3, so3

MOST = 1.5  # of the foretold error
NOISE = ("--sigma", "0.5", "--pose-noise", "0.2,0.02")


@dataclass
class Path_:
    """The folder of a builder, the built machine, and what the commands said."""

    home: Path
    cell: Cell
    said: dict

    def run(self, *words):
        """One command, which must succeed."""
        with chdir(self.home):
            ran = robocal(*words)
        assert ran.status == 0, (words, ran.out, ran.remarks)
        self.said[" ".join(map(str, words[:2]))] = ran
        return ran

    def fill_in(self, folder, poses):
        """What somebody measures at poses: both tables of a folder, by the ids that are there."""
        rows = [line.split(",")[0] for line in (self.home / folder / "lengths.csv").read_text().splitlines()[2:]]
        cables = [f"c{i} [mm]" for i in range(1, 9)]
        write(self.home / folder / "lengths.csv", rows, cables, self.cell.shown(poses))
        write(self.home / folder / "measured.csv", rows, HEADER, self.cell.seen(poses))


def anywhere(rng, count):
    """Poses in the middle of the frame."""
    vector = np.concatenate([rng.uniform(-0.7, 0.7, (count, 3)) + [0, 0, 1.5], rng.normal(0, 0.12, (count, 3))], axis=1)
    return se3.from_vector(vector)


def walk(home, seed):
    """The ten commands, with what is measured between them."""
    path = Path_(home, None, {})
    path.run("new", "cable", "-o", "cell")  # 1
    robot = read_cable(home / "cell" / "robot.yaml").robot
    path.cell = cell = Cell(robot.a, robot.b, seed)
    path.run("cable", "poses", "cell/robot.yaml", "-n", 200, "--choose", 20, *NOISE, "-o", "first")  # 2
    path.fill_in("first", read_platform_poses(home / "first" / "chosen.csv", robot).values)
    data = "first/lengths.yaml", "first/poses.yaml"
    path.run("check", "cell/robot.yaml", *data)  # 3
    path.run("identify", "cell/robot.yaml", *data, "-o", "run")  # 4
    path.run("new", "run", "-o", "tuesday")  # 5: another day, another power-up, another place of the tracker
    cell.zeros, cell.tracker = cell.rng.uniform(-2, 2, 8), cell.stand()
    path.fill_in("tuesday", anywhere(cell.rng, 20))
    path.run("validate", "run", "tuesday/lengths.yaml", "tuesday/poses.yaml", "--against", "cell/robot.yaml")  # 6
    home_pose = se3.from_vector(np.array([[0, 0, 1.5, 0, 0, 0]]))
    write(home / "home.csv", ["home"], [f"c{i} [mm]" for i in range(1, 9)], cell.shown(home_pose))
    path.run("cable", "rezero", "run", "home.csv", "--at", "0,0,1500", "-o", "today.yaml")  # 7
    path.run("cable", "poses", "today.yaml", "-n", 20, "-o", "program")  # 8
    path.run("cable", "contact", "today.yaml", "program/program.csv")  # 9
    return path


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return walk(tmp_path_factory.mktemp("path"), 1)


def errors(path, seed, count=40):
    """The tenth command, `cable forward` of fresh lengths: errors of the positions in m (rms), wherever the base stands, and what was
    foretold of them."""
    cell, home = path.cell, path.home
    fresh = anywhere(np.random.default_rng(seed), count)
    write(home / "fresh.csv", [f"f{i}" for i in range(count)], [f"c{i} [mm]" for i in range(1, 9)], cell.shown(fresh))
    ran = path.run("predict", "run", "fresh.csv", "--json")
    return fresh, json.loads(ran.out)
