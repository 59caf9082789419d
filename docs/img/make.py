"""Draws before-after.svg from the demo's simulated six-axis arm and cable-robot.svg: python docs/img/make.py [FOLDER]."""

from __future__ import annotations

import csv
import sys
import tempfile
from pathlib import Path

import numpy as np

from robocal.cables.boundary import surface
from robocal.cables.geometry import CableRobot
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import distribute
from robocal.cables.workspace import Demand
from robocal.cli.main import main
from robocal.files.cable.cable_robot import read_cable
from robocal.report.cable.scene import scene
from robocal.report.pictures import before_after

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def columns(path: Path) -> dict[str, list[object]]:
    """residuals.csv by column; empty cells are None."""
    with path.open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    texts = ("configuration", "set", "set_aside", "group", "kind", "target", "fingerprint")
    return {
        name: [row[name] if name in texts else float(row[name]) if row[name] else None for row in rows]
        for name in rows[0]
    }


def draw() -> str:
    """The picture as SVG text."""
    with tempfile.TemporaryDirectory() as folder:
        status = main(["demo", "tracker", "-o", folder])
        if status:
            raise SystemExit(status)
        return before_after(columns(next(Path(folder).rglob("residuals.csv"))))


def robot(path: Path = EXAMPLES / "cable-laval" / "robot.yaml") -> str:
    """A cable robot, its tensions and where it can be held, as SVG text."""
    machine: CableRobot = read_cable(path).robot
    mass, pose = float(machine.need("mass")), machine.home[None]
    held = distribute(structure_of(machine, pose), gravity_wrench(pose, mass, machine.com), machine.need("limits"))
    box = np.stack([machine.a.min(axis=0), machine.a.max(axis=0)], axis=1)
    boundary = surface(machine, Demand(np.array([mass])), pose[0, :3, 3], box, count=350)
    return scene(machine, pose[0], tension=held.tension[0], surface=boundary)


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    for name, made in (("before-after", draw), ("cable-robot", robot)):
        (target / f"{name}.svg").write_text(made(), encoding="utf-8")
        print(target / f"{name}.svg")
