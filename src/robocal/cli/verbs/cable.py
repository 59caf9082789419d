"""Verbs of cable robots: `robocal cable ...`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from robocal.cli import listing as p
from robocal.cli import options as o
from robocal.cli import workspace as w
from robocal.cli.verbs.task import Task, task

__all__ = ["CABLE", "forward", "inverse", "poses", "tension", "workspace"]


def inverse(
    robot: o.CableRobot,
    poses: o.PlatformPoses,
    tension: o.Tension = None,
    sag: o.Sag = False,
    output: o.OutputFile = None,
    force: o.Force = False,
    json: o.Json = False,
) -> Task:
    """Lengths of the cables at poses of the platform.

    \b
    robocal cable inverse robot.yaml poses.csv -o lengths.csv
    robocal cable inverse robot.yaml poses.csv --tension 60 --sag
    """
    return task("cable.inverse", locals())


def forward(
    robot: o.CableRobot,
    lengths: o.CableLengths,
    sigma: o.LengthNoise = None,
    starts: o.Starts = 24,
    tension: o.Tension = None,
    sag: o.Sag = False,
    seed: o.Seed = 0,
    output: o.OutputFile = None,
    force: o.Force = False,
    json: o.Json = False,
) -> Task:
    """Poses of the platform from lengths of its cables, with how sure they are and whether they are the only ones.

    Exit status 3 when a pose was not found, is not the only one, or does not fit its lengths.

    \b
    robocal cable forward robot.yaml lengths.csv --sigma 0.5 -o poses.csv
    """
    return task("cable.forward", locals())


def tension(
    robot: o.CableRobot,
    poses: o.PlatformPoses,
    method: o.TensionMethod = "norm",
    power: o.Power = None,
    mass: o.Mass = None,
    payload: o.Payload = 0.0,
    wrench: o.Wrench = None,
    limits: o.TensionLimits = None,
    length: o.MomentLength = None,
    output: o.TensionFolder = None,
    force: o.Force = False,
    json: o.Json = False,
) -> Task:
    """Tensions that hold the platform at poses, their margins, and the wrench that is missing where none do.

    Exit status 3 when a pose is not held. The list that it writes goes into cable inverse and cable forward as it is.

    \b
    robocal cable tension robot.yaml poses.csv -o held
    robocal cable tension robot.yaml poses.csv --method barycentre --payload 5
    """
    return task("cable.tension", locals())


def workspace(
    robot: o.CableRobot,
    orientation: w.Orientation = [],  # noqa: B006
    tilt: w.Tilt = None,
    payload: w.Payloads = None,
    mass: w.Masses = None,
    wrench: w.Wrenches = [],  # noqa: B006
    acceleration: w.Acceleration = 0.0,
    reserve: w.Reserve = 0.0,
    limits: o.TensionLimits = None,
    length: o.MomentLength = None,
    box: w.Box = None,
    cells: w.Cells = 41,
    rays: w.Rays = 4000,
    start: w.RayStart = None,
    output: w.Folder = None,
    force: o.Force = False,
    json: o.Json = False,
) -> Task:
    """Where the platform can be held: volume by a grid and by rays to the exact boundary, margins, sections, a mesh.

    Exit status 3 when it can be held nowhere.

    \b
    robocal cable workspace robot.yaml -o held
    robocal cable workspace robot.yaml --payload 0,20 --tilt 10 --acceleration 2
    """
    return task("cable.workspace", locals())


def poses(
    robot: o.CableRobot,
    count: p.Count = 200,
    margin: p.Margin = 0.95,
    start: p.Start = "mean",
    box: p.Box = None,
    scale: p.Scale = 1.1,
    turn: p.Turn = None,
    diameter: p.Diameter = None,
    body: p.Body = "hull",
    relief: p.Relief = None,
    payload: o.Payload = 0.0,
    mass: o.Mass = None,
    limits: o.TensionLimits = None,
    method: o.TensionMethod = "norm",
    steps: p.Waypoints = 10,
    wanted: p.Choose = None,
    criterion: p.Criterion = "A",
    sigma: p.Sigma = None,
    pose_noise: p.PoseNoise = None,
    seed: o.Seed = 0,
    output: p.Folder = None,
    force: o.Force = False,
    json: o.Json = False,
) -> Task:
    """Poses that the platform can reach and leave again: held on all the way, and no cable touches anything.

    \b
    robocal cable poses robot.yaml -n 500 --choose 20 -o list
    robocal cable poses robot.yaml --start best --mu 0.8
    """
    return task("cable.poses", locals())


CABLE: dict[Callable[..., Any], str] = {
    inverse: "Lengths from poses.",
    forward: "Poses from lengths.",
    tension: "Tensions that hold poses.",
    workspace: "Where the platform can be held.",
    poses: "Poses that can be reached.",
}
