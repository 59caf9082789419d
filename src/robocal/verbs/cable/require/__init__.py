"""`cable require`: how good a calibration will be, and which sensors and how many poses it needs to be as good as it must."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from robocal._record import record
from robocal.report.sections import Section
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch, details, run_verb

if TYPE_CHECKING:
    from robocal.verbs.cable.require.result import Required

__all__ = ["Options", "details", "run", "sections"]

FILES = ("require.json", "contours.csv", "report.html")


@record
class Options(BaseOptions):
    """Predict the accuracy of a calibration of frame anchors and zeros, before anything is measured. With --accuracy, compute which
    sensors and how many poses it needs.

    Exit status 3 when the accuracy is not reached with these noises and poses.

    \b
    robocal cable require robot.yaml poses.csv --sigma 3mm --sigma-position 2mm --sigma-orientation 1deg
    robocal cable require robot.yaml poses.csv --sigma 1mm --sigma-position 1mm --accuracy 5mm -o needed
    """

    robot: w.CableRobot
    poses: w.PlatformPoses
    sigma: str = option("1mm", "Standard deviation of a length", "SIGMA")
    sigma_position: str | None = option(
        None, "The same of a component of the measured position", "SIGMA", otherwise="known exactly"
    )
    sigma_orientation: str | None = option(
        None, "The same of a component of the measured rotation vector", "SIGMA", otherwise="known exactly"
    )
    accuracy: str | None = option(None, "The required error, root mean square", "ERROR")
    of: str = option(
        "anchors", "Quantity of --accuracy: frame anchors (components), zeros, or the platform's position or orientation", "WHAT",
        choices=("anchors", "zeros", "position", "orientation"),
    )  # fmt: skip
    estimator: str = option(
        "maximum-likelihood", "Maximum likelihood with free poses, as identify does it, or every cable by itself", "NAME",
        choices=("maximum-likelihood", "per-cable"),
    )  # fmt: skip
    output: Path | None = option(None, f"Write {', '.join(FILES[:-1])} and {FILES[-1]} here", "DIR", short="-o")
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Required]:
    """Expected errors, and what an accuracy needs. Raises InputError."""
    from robocal.verbs.cable.require.result import compute_requirement

    return run_verb(o, FILES, lambda: compute_requirement(o, command), sections, details)


def sections(made: Outcome[Required]) -> Iterator[Section]:
    """The errors to be expected, and what is needed."""
    from robocal.verbs.cable.require.result import require_summary

    yield from require_summary(made.result, made.written)
