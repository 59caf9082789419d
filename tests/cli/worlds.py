"""What mutations are made of: folders of small valid files with the commands that read them, one world for each sort of file.

A world may have a judge: what must hold when its command ends with status 0, whatever the mutation made of the files.
"""

from __future__ import annotations

import hashlib
import json
import random
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from cables.cable_robots import box
from cli.runs import Ran, robocal, small
from cli.test_urdf_runs import URDF
from files.kind_samples import KINDS, texts
from files.test_cable import caspr
from listings import rows_of

from robocal.arms.conventions import CONVENTIONS
from robocal.errors import InputError
from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.pose_lists import read_platform_poses
from robocal.files.cable.write import describe_cable
from robocal.files.dataset import read_dataset
from robocal.files.robot import read_robot
from robocal.files.templates import convention_chain, templates

Command = tuple[object, ...]
Judge = Callable[[Path, Ran], None]
POSES = "id,j1 [deg],j2 [deg],j3 [deg]\na,1,2,3\nb,10,20,30\nc,-20,5,40\n"
TARGETS = "id,j1 [deg],j2 [deg],j3 [deg]\nt1,1,2,3\nt2,10,20,30\n"
REGION = "robocal: 1\nkind: region\nunits: {length: mm, angle: deg}\njoints: {j1: [-90, 90], j2: [0, 60]}\n"
PLACES = "id,x [mm],y [mm],z [mm],rx [deg],ry [deg],rz [deg]\nlow,100,-200,900,0,0,0\nhigh,300,200,1600,5,3,-10\n"
FLAT_PLACES = "id,x [mm],y [mm],z [mm],rx [deg],ry [deg],rz [deg]\na,100,0,1500,0,2,0\nb,-300,0,1200,0,0,0\n"
CABLE = describe_cable(box()) + (
    "platform: {mass: 12}\nevery_cable: {tension: [10, 400], elasticity: 2.5e-5, density: 0.3}\n"
)
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


@dataclass(frozen=True)
class World:
    """Files (name: text) that are damaged one at a time, the commands of which one is run, and what else must hold."""

    files: dict[str, str]
    commands: Sequence[Command]
    judge: Judge | None = None
    sealed: bool = False  # a run folder: damage that a stranger would have hidden has its hash recorded

    def write(self, folder: Path) -> None:
        """All files as they are right."""
        for name, text in self.files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text, encoding="utf-8")

    def seal(self, folder: Path, name: str) -> None:
        """Writes the hash of a damaged file where it is recorded."""
        recorded = json.loads(self.files["run/result.json"])
        recorded["files"][Path(name).name] = hashlib.sha256((folder / name).read_bytes()).hexdigest()
        (folder / "run" / "result.json").write_text(json.dumps(recorded), encoding="utf-8")


def read(robot: str, data: str) -> Command:
    """A command that only reads a data file: what every verb does first, without what comes after."""
    return "read", robot, data


def run(folder: Path, command: Command) -> Ran:
    """A command in a folder; words that are names of files there are taken from it."""
    words = [folder / w if isinstance(w, str) and ("." in w or w == "run") else w for w in command]
    if words[0] != "read":
        return robocal(*words)
    try:
        read_dataset(words[2], read_robot(words[1]).chain)  # type: ignore[arg-type]
    except InputError as error:
        return Ran(2, "", f"error: {error}\n")
    return Ran(0, "", "")


def held(folder: Path, ran: Ran) -> None:
    """Tensions that are called feasible hold the platform of the damaged file; written out here, over straight cables."""
    if not ran.out.startswith("{") or "poses" not in ran.document:
        return
    robot = read_cable(folder / "robot.yaml").robot
    if robot.pulleys is not None:
        return
    pose = read_platform_poses(folder / "list.csv", robot).values
    for i, told in enumerate(rows_of(ran.document["poses"])):
        if told.get("tension") is None:
            continue
        t = np.array(told["tension"])
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


def robots(folder: Path, rng: random.Random) -> World:
    """A robot of any convention."""
    text = templates(convention_chain(rng.choice(tuple(CONVENTIONS)), 3))["robot.yaml"]
    base = ("robot.yaml",)
    forms = [("export", *base, "--format", form) for form in ("csv", "yaml", "urdf", "dh", "markdown")]
    return World({"robot.yaml": text}, [("check", *base), ("check", *base, "--json"), *forms])


def kinds(folder: Path, rng: random.Random) -> World:
    """Data of any kind of measurement."""
    described, table = texts(rng.choice(KINDS))
    robot = small(folder / "arm", poses=14)["robot.yaml"]
    commands = [read("robot.yaml", "data.yaml")] * 19 + [("check", "robot.yaml", "data.yaml")]
    return World({"robot.yaml": robot, "data.yaml": described, "table.csv": table}, commands)


def urdf(folder: Path, rng: random.Random) -> World:
    """An arm as a URDF."""
    forms = [("export", "u.urdf", "--format", form) for form in ("yaml", "csv", "urdf")]
    return World({"u.urdf": URDF}, [("check", "u.urdf"), *forms])


def caspr_files(folder: Path, rng: random.Random) -> World:
    """A cable robot of CASPR, two files."""
    caspr(folder)
    made = {name: (folder / name).read_text() for name in ("flat_cables.xml", "flat_bodies.xml")}
    made["list.csv"] = FLAT_PLACES
    verbs = [("cable", verb, "flat_cables.xml", "list.csv") for verb in ("inverse", "tension")]
    return World(made, [*verbs, verbs[1] + ("--json",), ("import", "flat_cables.xml")])


def cables(folder: Path, rng: random.Random) -> World:
    """A cable robot with its lists, over pulleys or not, in space or in a plane."""
    over = CABLE.replace("density: 0.3", "density: 0.3, pulley: {radius: 0.05, axis: [0, 0, 1]}")
    robot, places = rng.choice(((CABLE, PLACES), (over, PLACES), (PLANAR, FLAT_PLACES)))
    World({"robot.yaml": robot, "list.csv": places}, ()).write(folder)
    lengths = robocal("cable", "inverse", folder / "robot.yaml", folder / "list.csv").out
    inverse = ("cable", "inverse", "robot.yaml", "list.csv")
    tension = ("cable", "tension", "robot.yaml", "list.csv", "--json")
    methods = [tension + ("--method", m) for m in ("mid", "barycentre", "closed", "p-norm")]
    forward = ("cable", "forward", "robot.yaml", "lengths.csv", "--starts", 2)
    commands = [inverse, inverse + ("--tension", 60), inverse + ("--tension", 60, "--sag"), forward, tension, *methods]
    return World({"robot.yaml": robot, "list.csv": places, "lengths.csv": lengths}, commands, held)


def runs(folder: Path, rng: random.Random) -> World:
    """A run folder and what is asked of it."""
    small(folder, poses=14)
    robocal("identify", folder / "robot.yaml", folder / "data.yaml", "-o", folder / "run")
    names = [f"run/{p.name}" for p in sorted((folder / "run").iterdir()) if p.suffix in (".json", ".yaml", ".csv")]
    made = {name: (folder / name).read_text() for name in names}
    made |= {"poses.csv": POSES, "targets.csv": TARGETS, "region.yaml": REGION}
    shutil.rmtree(folder / "run")
    forms = [("export", "run", "--format", form) for form in ("offsets", "ros", "xacro", "csv", "urdf")]
    commands = [
        *(("predict", "run", "poses.csv"), ("predict", "run", "poses.csv", "--json"), ("report", "run"), *forms),
        *(("compensate", "run", "targets.csv"), ("drift", "run", "run"), ("validate", "run", "data.yaml")),
    ]
    return World(made, commands, sealed=True)


# How many of a hundred mutations each gets.
WORLDS: dict[str, tuple[Callable[[Path, random.Random], World], int]] = {
    "robots": (robots, 20), "kinds": (kinds, 18), "urdf": (urdf, 21), "caspr": (caspr_files, 19), "cables": (cables, 11),
    "runs": (runs, 8),
}  # fmt: skip
ARMS = 3  # of a hundred: identified, and judged by the truth
