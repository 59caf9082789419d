"""Verbs that hand results on: export, report."""

from __future__ import annotations

from robocal.cli import options as o
from robocal.cli.verbs.task import Task, task

__all__ = ["export", "report"]


def export(
    robot: o.AnyRobot,
    output: o.OutputFile = None,
    form: o.Form = "yaml",
    nominal: o.Nominal = None,
    force: o.Force = False,
    base: o.Base = None,
    tip: o.Tip = None,
    json: o.Json = False,
) -> Task:
    """Hand a robot model on: robot.yaml, URDF, a table of its parameters, or joint offsets for a controller.

    \b
    robocal export run --format offsets
    robocal export run --format urdf -o calibrated.urdf
    robocal export ur10 --format markdown
    """
    return task("export", locals())


def report(folder: o.Run, output: o.PageFile = None, json: o.Json = False) -> Task:
    """Write report.html again, from the result.json and residuals.csv of a run folder."""
    return task("report", locals())
