"""`cable contact`: whether a path of one's own can be gone, without a contact and within the tension limits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from robocal.report.sections import Section, Text, ends, figure, table
from robocal.verbs import words as w
from robocal.verbs.option import Told
from robocal.verbs.outcome import Outcome, Watch

__all__ = ["Options", "run", "sections"]

SHOWN = 20  # motions that cannot be gone


@dataclass(frozen=True)
class Options(Told):
    """Check a path: straight motions from each pose of a list to the next, for contacts of cables and platform and for tensions.

    Contacts are certain between the poses, not only at them. Exit status 3 where a motion cannot be gone to its end; how far it can is
    its share, 0 to 1.

    \b
    robocal cable contact robot.yaml path.csv
    robocal cable contact robot.yaml list/program.csv --payload 2 -o legs.csv
    """

    robot: w.CableRobot
    poses: w.PlatformPoses
    diameter: w.Diameter = None
    body: w.PlatformBody = "hull"
    relief: w.Relief = None
    payload: w.Payload = 0.0
    mass: w.PlatformMass = None
    limits: w.TensionLimits = None
    output: w.OutputFile = None
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome:
    """The motions of a path; a file gets all of them. Raises InputError."""
    from robocal.files.writing import refuse_existing, write_text
    from robocal.jobs.cable.contact import path_of

    refuse_existing(o.output, (), o.force)
    made = path_of(o, command)
    written = () if o.output is None else (write_text(o.output, made.text),)
    return Outcome(made, lambda: made.document, made.whole, made.remarks, written=written)


def sections(made: Outcome) -> Iterator[Section]:
    """How many motions can be gone, and those that cannot."""
    found = made.result
    stopped = [row for row, whole in zip(found.rows, found.found.whole, strict=True) if not whole]
    count = len(found.rows)
    words = f"   {count - len(stopped)} of {count} motions can be gone to their end"
    yield Section.of("", Text.of((found.file.robot.name, "strong"), words))
    if stopped:
        rows = [(a, b, figure(share, 4), why) for a, b, share, why in stopped[:SHOWN]]
        more = f"and {len(stopped) - SHOWN} more; --json and -o have all" if len(stopped) > SHOWN else ""
        yield Section.of(
            "", table("from", "to", "free share", "ends by", right=(2,), rows=rows), Text.of(more) if more else None
        )
    yield from ends(made.remarks, made.written)
