"""`cable forward`: poses of the platform from lengths of its cables."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robocal._record import record
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, arg, option
from robocal.verbs.outcome import Outcome, Watch, run_verb
from robocal.verbs.outcome import path_sections as sections

if TYPE_CHECKING:
    from robocal.verbs.cable.forward.result import Poses

__all__ = ["Options", "run", "sections"]


@record
class Options(BaseOptions):
    """Poses of the platform from lengths of its cables, with their uncertainty and the number of other solutions.

    With a run folder as ROBOT, the standard deviations include the uncertainty of its calibration.

    Exit status 3 when a pose was not found, is not the only one, or does not fit its lengths.

    \b
    robocal cable forward robot.yaml lengths.csv --sigma 0.5 -o poses.csv
    """

    robot: w.CableRobot
    lengths: str = arg(
        ..., "LENGTHS", "CSV: one column per cable, such as c1 [mm]; c1.geometric [mm] for lengths without stretch."
    )
    sigma: float | None = option(None, "Standard deviation of a length", "SIGMA", unit="length", above=0, wrong=w.NOISE)
    starts: int = option(24, "Number of further starts, to find other poses", "N", least=0)
    tension: w.CableTension = None
    sag: w.Sag = False
    seed: w.Seed = 0
    output: w.OutputFile = None
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Poses]:
    """Poses with their residuals, covariance and number of solutions. Raises InputError."""
    from robocal.verbs.cable.forward.result import find_poses

    return run_verb(o, (), lambda: find_poses(o, command))
