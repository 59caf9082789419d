"""Verbs that say how far a result can be trusted: predict, drift."""

from __future__ import annotations

from robocal.cli import options as o
from robocal.cli.verbs.task import Task, task

__all__ = ["drift", "predict"]


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


def drift(
    first: o.FirstRun,
    second: o.SecondRun,
    new_tool: o.NewTool = False,
    matters: o.Matters = "0.1mm",
    output: o.DriftFolder = None,
    json: o.Json = False,
) -> Task:
    """Compare two calibrations of one robot: has it changed, by how many millimetres, and where does it show?

    Both runs must start from the same robot file. The instrument may stand elsewhere; with --new-tool the tool too.

    \b
    robocal drift march/run june/run
    robocal drift march/run june/run --matters 0.2mm
    robocal drift march/run june/run --new-tool --json

    unchanged: the 95 % interval of the change lies below what matters; drifted: it lies above; possible: the runs do not tell.
    Exit status 0 when they could be compared, whatever came of it; 3 when nothing follows from these runs.
    """
    return task("drift", locals())
