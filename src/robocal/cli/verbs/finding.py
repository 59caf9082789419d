"""Verbs that find something out: demo, check, identify, validate."""

from __future__ import annotations

from robocal.cli import options as o
from robocal.cli.verbs.task import Task, task

__all__ = ["check", "demo", "identify", "validate"]


def demo(
    name: o.DemoName = None, output: o.DemoFolder = "robocal-demo", seed: o.Seed = 0, json: o.Json = False
) -> Task:
    """Calibrate three arms, two simulated and one really measured, and write their reports.

    \b
    rv-2aj   the Mitsubishi RV-2AJ of a published calibration (simulated)
    camera   ten real camera readings that support no calibration: refused
    tracker  a six-axis arm with typical factory errors (simulated)

    Exit status 0 when every case came out as it should.
    """
    return task("demo", locals())


def check(
    robot: o.Robot,
    data: o.MaybeData = None,
    exclude: o.Exclude = [],  # noqa: B006
    base: o.Base = None,
    tip: o.Tip = None,
    json: o.Json = False,
) -> Task:
    """Say what robot and data files contain and what they can tell, without fitting.

    Joints, rows, where sigma comes from, what is free, and what will not be told apart and why.

    \b
    robocal check robot.yaml data.yaml
    """
    return task("check", locals())


def identify(
    robot: o.Robot,
    data: o.Data,
    output: o.RunFolder = None,
    force: o.ForceRun = False,
    free: o.Free = [],  # noqa: B006
    fix: o.Fix = [],  # noqa: B006
    prior: o.Prior = [],  # noqa: B006
    exclude: o.Exclude = [],  # noqa: B006
    groups: o.Groups = [],  # noqa: B006
    layer: o.LayerOption = False,
    region: o.WorkingRange = None,
    method: o.Method = "lm",
    compare: o.Compare = None,
    loss: o.Loss = "none",
    hold_out: o.HoldOut = None,
    group: o.GroupColumn = None,
    folds: o.Folds = None,
    blocks: o.Blocks = 10,
    reselect: o.Reselect = False,
    leave_one_out: o.LeaveOneOut = None,
    keep_all: o.KeepAll = False,
    iterations: o.Iterations = 100,
    particles: o.Particles = 1000,
    bootstrap: o.Bootstrap = None,
    seed: o.Seed = 0,
    base: o.Base = None,
    tip: o.Tip = None,
    json: o.Json = False,
) -> Task:
    """Identify a robot's true parameters from measurements, and prove the gain on configurations that were not used.

    \b
    robocal identify robot.yaml data.yaml -o run
    robocal identify ur10 tracker.csv camera.yaml --fix j1 --loss huber
    robocal identify rv-2aj data.yaml --method pinv --free alpha,beta,d,r
    robocal identify panda front.yaml right.yaml high.yaml --hold-out group --folds 3
    robocal identify robot.yaml data.yaml --compare
    robocal identify robot.yaml data.yaml --groups eccentricity,ripple,compliance --layer

    Exit status 0 when the verdict is improved, 3 when it is not, or only where it was measured (see --region).
    """
    return task("identify", locals())


def validate(
    robot: o.Robot,
    data: o.Data,
    against: o.Against = None,
    offsets: o.OffsetsFile = None,
    distances: o.Distances = "consecutive",
    exclude: o.Exclude = [],  # noqa: B006
    output: o.ValidationFolder = None,
    seed: o.Seed = 0,
    base: o.Base = None,
    tip: o.Tip = None,
    json: o.Json = False,
) -> Task:
    """Measure the error of a robot model on data that it was not fitted to.

    With repeated visits also pose accuracy and repeatability, and distance accuracy, as ISO 9283 defines them.

    The robot stays as it is. Frames of instruments that the data leave free are fitted again; the figures are then
    labelled profiled.

    \b
    robocal validate run other.yaml --against robot.yaml
    robocal validate robot.yaml other.yaml --offsets offsets.csv
    """
    return task("validate", locals())
