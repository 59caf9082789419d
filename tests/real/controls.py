"""The controls: data that are right, as a person would hand them in; each maker writes what it needs into a folder and
returns the words of the command line."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import numpy as np
from real import test_franka, test_positioner, test_sockets
from ruamel.yaml import YAML

EXAMPLES = Path(__file__).parents[2] / "examples"
UR10 = EXAMPLES / "ur10-tracker"
SERIES = {"C": "Series_C/measurements_random_poses.csv", "D": "Series_D/measurements_iso_cubes.csv"}


def ur10(series, rows=None, seed=0):
    """A series of the UR10, whole or so many random rows of it."""

    def write(folder, shared):
        published = shared / "ur10-laser-tracker" / SERIES[series]
        lines = published.read_text(encoding="utf-8-sig").splitlines()
        chosen = range(1, len(lines))
        if rows is not None:
            chosen = np.sort(1 + np.random.default_rng(seed).permutation(len(lines) - 1)[:rows])
        (folder / "some.csv").write_text("\n".join([lines[0], *(lines[i] for i in chosen)]) + "\n")
        text = (UR10 / "data.yaml").read_text().replace("measurements_random_poses.csv", "some.csv")
        (folder / "data.yaml").write_text(text)
        return [str(UR10 / "robot.yaml"), str(folder / "data.yaml")]

    return write


def fr3(kind):
    def write(folder, shared):
        text = test_franka.DATA.format(kind=kind, file=shared / "franka-fr3-board" / "poses.csv")
        (folder / "data.yaml").write_text(text)
        return ["fr3", str(folder / "data.yaml")]

    return write


def sockets(arm):
    def write(folder, shared):
        return [arm, str(test_sockets.write(folder, shared, arm)), "--hold-out", "group", "--folds", "3"]

    return write


def positioner(folder, shared):
    rows = YAML(typ="safe").load(shared / "positioner" / "positioner_kinematic_measurements.yaml")
    names = ("x", "y", "z", "qx", "qy", "qz", "qw")
    told = [(*r["target_joints"], *(r["pose"][n] for n in names)) for _, r in sorted(rows.items())]
    lines = [",".join(("tilt", "turn", *names)), *(",".join(map(repr, t)) for t in told)]
    (folder / "poses.csv").write_text("\n".join(lines) + "\n")
    (folder / "robot.yaml").write_text(test_positioner.ROBOT)
    (folder / "data.yaml").write_text(test_positioner.DATA)
    return [str(folder / "robot.yaml"), str(folder / "data.yaml")]


def example(name, number=0):
    """A command of an example's README, without the folder that it writes."""

    def write(folder, shared):
        text = (EXAMPLES / name / "README.md").read_text(encoding="utf-8")
        lines = [s for s in re.findall(r"^robocal .*$", text, re.MULTILINE) if s.startswith("robocal identify")]
        words = shlex.split(lines[number])[2:]
        words = words[: words.index("-o")] if "-o" in words else words
        shutil.copytree(EXAMPLES, folder / "examples", dirs_exist_ok=True)
        return [str(folder / w) if w.startswith("examples/") else w for w in words]

    return write
