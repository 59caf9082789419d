"""`verify`: poses of a robot, or of several ways to measure it, against an external instrument."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from robocal._record import record
from robocal.report.sections import Section, ends
from robocal.verbs import shared_options as w
from robocal.verbs.option import Arg, BaseOptions, arg, option
from robocal.verbs.outcome import Outcome, Watch, run_verb

if TYPE_CHECKING:
    from robocal.session.pose_groups import AnovaResult
    from robocal.session.verified_poses import Verified

__all__ = ["Options", "run", "sections"]

FILES = ("verify.json", "report.html")
SOURCES = Arg("SOURCES...", "The poses to compare: of the robot, of its camera, ...; the same ids.")


@record
class Options(BaseOptions):
    """Compare poses with those of an external instrument: as measured, relative to the first one, and
    after the best alignment.

    Files of poses are CSV whose headers carry units (id, x [mm], ..., rx [deg], ...), or data.yaml with kind: pose and any
    form of orientation, or with kind: position and three targets or more on the platform. For two sources and a
    reference, the report shows which of them agree. It also tests whether means of errors differ (one-way analysis of
    variance).

    \b
    robocal verify tracker.csv robot.csv
    robocal verify tracker.csv robot.csv camera.csv -o verified
    robocal verify groups.csv --summary

    With --summary the one file holds means and standard deviations: group, n, NAME_mean, NAME_sd.

    Exit status 3 when a source cannot have the poses of the reference: another unit, mirrored, other rows.
    """

    reference: str = arg(..., "REFERENCE", "The poses of the external instrument; with --summary a table of groups.")
    sources: Annotated[tuple[str, ...], SOURCES] = ()
    summary: bool = option(False, "Analysis of variance from means and standard deviations")
    output: Path | None = option(None, f"Write {FILES[0]} and {FILES[1]} here", "DIR", short="-o")
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Verified | AnovaResult]:
    """Compares poses, or means. Raises InputError."""
    from robocal.errors import ModelError
    from robocal.session.pose_groups import summarise_groups
    from robocal.session.verified_poses import verify_sources

    def find() -> Verified | AnovaResult:
        if not o.summary:
            return verify_sources(o.reference, o.sources, command)
        if o.sources:
            sources, expected = ", ".join(o.sources), "nothing beside it"
            raise ModelError("a summary is one file", key="--summary", found=sources, expected=expected)
        return summarise_groups(o.reference, command)

    return run_verb(o, FILES, find, sections)


def sections(made: Outcome[Verified | AnovaResult]) -> Iterator[Section]:
    """Errors by view, the analysis of variance, and who agrees with whom."""
    from robocal.report.verification import verification_sections

    yield from verification_sections(made.result.document)
    yield from ends(written=made.written)
