"""Verbs that say how far a result can be trusted: predict, drift."""

from __future__ import annotations

from robocal.cli import options as o
from robocal.cli.verbs.task import Task, task

__all__ = ["predict"]


def predict(
    folder: o.KnowingRun,
    poses: o.JointTable,
    absolute: o.Absolute = False,
    output: o.OutputFile = None,
    json: o.Json = False,
) -> Task:
    """Predict where the tool is at given joint values, with 95 % bands.

    Two bands: of the model's prediction, and of a new measurement there (as fitted: it adds the noise and what the
    model leaves). Bands are those of the arm's shape; --absolute adds what is not known of the base's place.

    \b
    robocal predict run poses.csv
    robocal predict run poses.csv -o predicted.csv
    """
    return task("predict", locals())
