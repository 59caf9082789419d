"""`cable contact`: whether a path of one's own can be gone, without a contact and within the tension limits."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from robocal._record import record
from robocal.report.sections import Detail, Section, Text, ends, listing_table
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch, details, run_verb

if TYPE_CHECKING:
    from robocal.verbs.cable.contact.result import Motions

__all__ = ["Options", "details", "run", "sections"]

FILES = ("legs.csv", "contact.json", "report.html")
SHOWN = 20  # motions that cannot be gone


@record
class Options(BaseOptions):
    """Check a path for contacts of cables and platform and for tensions: straight motions from each pose of a list to the next.

    Contacts are certified between the poses too. Exit status 3 where a motion is not possible to its end; its share, 0 to 1, is the
    possible part.

    \b
    robocal cable contact robot.yaml path.csv
    robocal cable contact robot.yaml list/program.csv --payload 2 -o path
    robocal cable contact robot.yaml targets.csv --from-first
    """

    robot: w.CableRobot
    poses: w.PlatformPoses
    from_first: bool = option(
        False, "Move to every pose from the first one, not from the one before: a list of targets"
    )
    diameter: w.Diameter = None
    body: w.PlatformBody = "hull"
    relief: w.Relief = None
    payload: w.Payload = 0.0
    mass: w.PlatformMass = None
    limits: w.TensionLimits = None
    output: Path | None = option(None, f"Write {', '.join(FILES[:-1])} and {FILES[-1]} here", "DIR", short="-o")
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Motions]:
    """The motions of a path; a folder gets FILES. Raises InputError."""
    from robocal.verbs.cable.contact.result import path_of

    return run_verb(o, FILES, lambda: path_of(o, command), sections, details)


def sections(made: Outcome[Motions]) -> Iterator[Section]:
    """How many motions can be gone, and those that cannot."""
    import numpy as np

    found = made.result
    stopped = np.flatnonzero(~found.legs.whole).tolist()
    count = len(found.legs.whole)
    words = f"   {count - len(stopped)} of {count} motions can be gone to their end"
    yield Section.of("", Text.of((found.robot.name, "strong"), words), Detail(lambda: [found.first_answer]))
    if stopped:
        more = f"and {len(stopped) - SHOWN} more; --json and -o have all" if len(stopped) > SHOWN else ""
        rows = listing_table(found.table_listing.take(stopped), most=SHOWN)
        yield Section.of("", rows, Text.of(more) if more else None)
    yield from ends(made.remarks, made.written)
