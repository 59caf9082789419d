"""`validate`: how wrong a robot model is on data that it was not fitted to."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from robocal._record import record
from robocal.report.sections import Section, ends
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch, run_verb

if TYPE_CHECKING:
    from robocal.verbs.validate.result import Validation

__all__ = ["Options", "run", "sections"]

FILES = ("validation.json", "validation.html")


@record
class Options(BaseOptions):
    """Measure the error of a robot model on data that it was not fitted to.

    With repeated visits, the result also has pose accuracy and repeatability, and distance accuracy, as defined in ISO 9283.

    The robot is not changed. Free frames of instruments are fitted again; the errors are then labelled "own frames fitted".

    \b
    robocal validate run other.yaml --against robot.yaml
    robocal validate robot.yaml other.yaml --offsets offsets.csv
    """

    robot: w.Robot
    data: w.Data
    against: str | None = option(None, "Compare with this robot, for example the nominal one", "ROBOT")
    offsets: str | None = option(None, "Validate these joint offsets (CSV, ROS, xacro) on the nominal robot", "FILE")
    distances: str = option(
        "consecutive", "Pairs of places: consecutive, all, group, or a column of the configurations", "PAIRS"
    )
    exclude: w.Exclude = ()
    output: Path | None = option(None, f"Write {FILES[0]} and {FILES[1]} here", "DIR", short="-o")
    force: w.Force = False
    seed: w.Seed = 0
    base: w.Base = None
    tip: w.Tip = None


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Validation]:
    """Validates a robot on data files; a folder gets validation.json and validation.html. Raises InputError."""
    from robocal.verbs.validate.result import validate_robot

    return run_verb(o, FILES, lambda: validate_robot(o, command, watch), sections)


def sections(made: Outcome[Validation]) -> Iterator[Section]:
    """The errors of a model, and of another one."""
    from robocal.report.validation import validation_sections

    yield from validation_sections(made.result.document)
    yield from ends(written=made.written)
