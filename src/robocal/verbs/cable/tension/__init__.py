"""`cable tension`: tensions that hold the platform at given poses, or the wrench that is missing."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from robocal._record import record
from robocal.cables.tension_choice import METHOD, POWER
from robocal.report.sections import Detail, Section, Text, Written, figure, listing_table
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch, details, run_verb

if TYPE_CHECKING:
    from robocal.verbs.cable.tension.result import Tensions

__all__ = ["Options", "details", "run", "sections"]

FILES = ("tensions.csv", "tension.json", "report.html")


@record
class Options(BaseOptions):
    """Tensions that hold the platform at poses, their margins, and the missing wrench where no tensions hold it.

    Exit status 3 when no tensions hold a pose. cable inverse and cable forward read the written list.

    \b
    robocal cable tension robot.yaml poses.csv -o tensions
    robocal cable tension robot.yaml poses.csv --method barycentre --payload 5
    """

    robot: w.CableRobot
    poses: w.PlatformPoses
    method: w.TensionMethod = METHOD
    power: float | None = option(None, "Exponent of --method p-norm, from 2 on", "P", otherwise=f"{POWER:g}")
    mass: w.PlatformMass = None
    payload: w.Payload = 0.0
    wrench: str | None = option(
        None,
        "Acts on the platform at its origin, base axes: the robot file's unit of force, and Nm",
        "FX,FY,FZ,MX,MY,MZ",
    )
    limits: w.TensionLimits = None
    length: w.MomentLength = None
    output: Path | None = option(None, f"Write {', '.join(FILES[:-1])} and {FILES[-1]} here", "DIR", short="-o")
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Tensions]:
    """Tensions with what they hold, margins and missing wrenches; a folder gets FILES. Raises InputError."""
    from robocal.verbs.cable.tension.result import compute_tensions

    return run_verb(o, FILES, lambda: compute_tensions(o, command), sections, details)


def sections(made: Outcome[Tensions]) -> Iterator[Section]:
    """How many poses are held, what each cable bears, and the pose with the least to spare."""
    found = made.result
    spread, names = found.spread, found.names
    head = f"   {int(spread.feasible.sum())} of {len(names)} poses are held, method {spread.method}, {figure(found.mass)} kg"
    yield Section.of("", Text.of((found.robot.name, "strong"), head), Detail(lambda: [found.first_answer]))
    if found.tension_range:
        yield Section.of("", listing_table(found.tensions_by_cable))
    if names:
        worst = int(found.margin.argmin())
        least = f"the least margin is {figure(float(found.margin[worst]))} N, at {names[worst]}"
        yield Section.of("", Text.of(least), Written(made.written))
