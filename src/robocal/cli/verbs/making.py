"""Verbs that make files: new, simulate."""

from __future__ import annotations

from robocal.cli import options as o
from robocal.cli.verbs.task import Task, task

__all__ = ["new", "simulate"]


def new(
    robot: o.Template = None,
    output: o.NewFolder = ".",
    joints: o.JointCount = 6,
    kind: o.Kind = "position",
    listing: o.List = False,
    force: o.Force = False,
    json: o.Json = False,
) -> Task:
    """Write a robot file, a data file and a table to fill in; of a cable robot its file and a list of poses.

    \b
    robocal new --list
    robocal new ur10 -o cell
    robocal new mdh-hayati --joints 5 -o cell
    robocal new cable -o cell
    """
    return task("new", locals())


def simulate(
    robot: o.Robot,
    output: o.SimulationFolder,
    poses: o.Poses = 80,
    at: o.At = None,
    kind: o.Kind = "position",
    noise: o.Noise = None,
    angle_noise: o.AngleNoise = None,
    length_error: o.LengthError = None,
    angle_error: o.AngleError = None,
    settings: o.Setting = [],  # noqa: B006
    frame: o.Where = "auto",
    seed: o.Seed = 0,
    force: o.Force = False,
    base: o.Base = None,
    tip: o.Tip = None,
    json: o.Json = False,
) -> Task:
    """Simulate measurements of a robot that is not quite its model: data, and the truth to compare with.

    \b
    robocal simulate irb-120 -n 80 --noise 0.05 -o sim
    robocal identify sim/robot.yaml sim/data.yaml
    robocal simulate rv-2aj --set j2.r=1.0 --length-error 0 --angle-error 0 -o sim
    """
    return task("simulate", locals())
