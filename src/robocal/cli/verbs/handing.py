"""Verbs that hand results on: compensate, export, report."""

from __future__ import annotations

from robocal.cli import options as o
from robocal.cli.verbs.task import Task, task

__all__ = ["compensate", "export", "report"]


def compensate(
    robot: o.AnyRobot,
    targets: o.Targets,
    nominal: o.Controller = None,
    tool: o.Tool = "calibrated",
    output: o.CompensationFolder = None,
    base: o.Base = None,
    tip: o.Tip = None,
    json: o.Json = False,
) -> Task:
    """Correct targets for a controller that keeps its nominal model: joint angles, and Cartesian poses.

    Every correction is checked by driving the calibrated model with it. Targets that cannot be reached are listed, not
    dropped.

    \b
    robocal compensate run program.csv -o program
    robocal compensate calibrated.yaml poses.csv --nominal robot.yaml
    """
    return task("compensate", locals())


def export(
    robot: o.AnyRobot,
    output: o.OutputFile = None,
    form: o.Form = "yaml",
    nominal: o.Nominal = None,
    into: o.Into = None,
    force: o.Force = False,
    base: o.Base = None,
    tip: o.Tip = None,
    json: o.Json = False,
) -> Task:
    """Hand a robot model on: robot.yaml, URDF, a table of its parameters, or joint offsets for a controller.

    \b
    robocal export run --format offsets
    robocal export run --format urdf -o calibrated.urdf
    robocal export run --format urdf --into robot.urdf -o calibrated.urdf
    robocal export ur10 --format markdown
    """
    return task("export", locals())


def report(folder: o.Run, output: o.PageFile = None, json: o.Json = False) -> Task:
    """Write report.html again, from the result.json and residuals.csv of a run folder."""
    return task("report", locals())
