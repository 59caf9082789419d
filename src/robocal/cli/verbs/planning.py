"""The verb that comes before measuring: plan."""

from __future__ import annotations

from robocal.cli import options as o
from robocal.cli import planning as p
from robocal.cli.verbs.task import Task, task

__all__ = ["plan"]


def plan(
    robot: o.Robot,
    data: p.Instrument = None,
    output: p.PlanFolder = None,
    count: p.Count = None,
    criterion: p.Criterion = "I",
    accuracy: p.Accuracy = None,
    after: p.After = [],  # noqa: B006
    kind: o.Kind = "position",
    noise: o.Noise = None,
    frame: o.Where = "auto",
    candidates: p.Candidates = 5000,
    listed: p.Listed = None,
    tests: p.Tests = None,
    task_box: p.TaskBox = None,
    box: p.Box = None,
    floor: p.Floor = None,
    pedestal: p.Pedestal = None,
    distance: p.Distance = None,
    cone: p.Cone = None,
    facing: p.Facing = None,
    seed: o.Seed = 0,
    force: o.Force = False,
    base: o.Base = None,
    tip: o.Tip = None,
    json: o.Json = False,
) -> Task:
    """Choose which poses to measure, and say how many are enough.

    Writes a joint program in an order that is short to travel, and the data file to be filled in.

    \b
    robocal plan ur10 -n 25 -o plan
    robocal plan robot.yaml data.yaml --accuracy 0.2 --floor 0 -o plan
    robocal plan robot.yaml --after data.yaml -n 10 -o more
    """
    return task("plan", locals())
