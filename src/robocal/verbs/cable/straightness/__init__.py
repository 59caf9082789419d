"""`cable straightness`: what sag and stretch of cables do to lengths and poses, and which tension makes it small enough."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from robocal._record import record
from robocal.report.sections import Section
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch, run_verb

if TYPE_CHECKING:
    from robocal.session.cable.straightness_result import Straightness

__all__ = ["Options", "details", "run", "sections"]

FILES = ("straightness.csv", "straightness.json", "robot.yaml", "report.html")  # the robot where loads tell its cables


@record
class Options(BaseOptions):
    """Sag, excess length and stretch of cables, in millimetres of length and of pose, and the least tension for a wanted error.

    Loads that were measured on a cable give its weight and its elasticity, as a constant and as a curve, with 95 % intervals. The
    folder then gets the robot's file with weight and constant elasticity.
    Without --tension, tensions are those of the list of poses, else the least ones that hold the platform.

    \b
    robocal cable straightness robot.yaml --poses poses.csv --wanted 1mm
    robocal cable straightness robot.yaml --loads sag.yaml --loads elongation.csv -o straight
    robocal cable straightness robot.yaml --span 4925 --at 4.6,10.4,14.5,18.6,100 --tension 20

    Exit status 3 when tensions hold no pose, or when the loads must not be trusted.
    """

    robot: w.CableRobot
    poses: str | None = option(
        None,
        "CSV of poses: x [m], y, z, rx [deg], ry, rz, or a quaternion",
        "POSES",
        otherwise="the middle of the frame",
    )
    wanted: str = option("1mm", "The error that is allowed, of a length and of a position", "ERROR")
    loads: tuple[str, ...] = option(
        (), "Measured loads of a cable: data.yaml, or a CSV whose headers carry units", "LOADS"
    )
    tension: w.CableTension = None
    span: float | None = option(
        None, "Span of the level cable in the table", "L", unit="length", above=0, otherwise="the longest cable"
    )
    at: tuple[str, ...] = option(
        (),
        "Tensions in that table, in the robot file's unit of force",
        "T",
        listed=True,
        otherwise="within the tension limits",
    )
    mass: w.PlatformMass = None
    payload: w.Payload = 0.0
    limits: w.TensionLimits = None
    output: Path | None = option(
        None, "Write straightness.csv, straightness.json and report.html here; with --loads also robot.yaml, with what they tell", "DIR",
        short="-o",
    )  # fmt: skip
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Straightness]:
    """What cables are off by, and which tension helps; a folder gets FILES. Raises InputError."""
    from robocal.verbs.cable.straightness.asked import compute_straightness

    return run_verb(o, FILES, lambda: compute_straightness(o, watch, command), sections, details)


def sections(made: Outcome[Straightness]) -> Iterator[Section]:
    """The errors at the poses, the tensions for what is wanted, the level cable, and what loads say."""
    from robocal.verbs.cable.straightness.tables import straightness_sections

    yield from straightness_sections(made.result, made.written)


def details(made: Outcome[Straightness]) -> Iterator[Section]:
    """What a page has room for: pictures, every load, how it was worked out."""
    from robocal.verbs.cable.straightness.tables import straightness_details

    yield from straightness_details(made.result)
