"""`cable rig`: a virtual rig, commissioned from a rough geometry to a verified calibration."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from robocal._record import record
from robocal.report.sections import Section
from robocal.verbs import shared_options as w
from robocal.verbs.option import Arg, BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch, run_verb

if TYPE_CHECKING:
    from robocal.session.commissioning.rig_commission import Commissioned

__all__ = ["Options", "details", "run", "sections"]

FILES = ("rig.json", "truth.yaml", "verify.json", "report.html")
SPEC = Arg("SPEC", "rig.yaml: what the robot truly is, what its builder believes, camera, markers, instruments, poses.")


@record
class Options(BaseOptions):
    """Simulate the commissioning of a cable robot: from a rough geometry through a list of poses to a verified calibration.

    A controller that believes the rough geometry moves the platform from X_0 to each pose and back. Lengths, tensions, corners of markers
    and poses of an instrument are recorded, and `identify` makes a calibration of them. The controller gets it, and ten
    further poses verify it. Each list has a folder with files that `identify`, `cable forward` and `verify` read.

    Exit status 3 where the rig stopped, or a calibration is not trusted.

    \b
    robocal cable rig examples/commissioning/rig.yaml -o rig
    robocal cable rig rig.yaml --anchors beacons --lists 3 -o rig
    """

    spec: Annotated[Path, SPEC]
    output: Path = option(..., "Folder for the files of the rig, a folder for each list, and a page", "DIR", short="-o")
    poses: int | None = option(
        None, "Calibration poses of a list", "N", short="-n", least=4, most=10_000, otherwise="as the file says"
    )
    lists: int | None = option(
        None, "Lists of poses, each calibrated by itself", "N", least=1, most=26, otherwise="as the file says"
    )
    anchors: str | None = option(
        None,
        "How the builder knows the anchors: tape or beacons",
        "HOW",
        choices=("tape", "beacons"),
        otherwise="as the file says",
    )
    images: bool = option(
        False, "Draw the images of the camera, and look for corners in them; otherwise corners are projected"
    )
    seed: w.Seed = 0
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Commissioned]:
    """Moves, records, calibrates and verifies; a folder gets everything. Raises InputError."""
    from robocal.session.commissioning.rig_commission import commission

    return run_verb(o, FILES, lambda: commission(o, watch, command), sections, details)


def details(made: Outcome[Commissioned]) -> Iterator[Section]:
    """The pictures of the verification."""
    from robocal.report.cable.commissioning import commissioning_details

    yield from commissioning_details(made.result)


def sections(made: Outcome[Commissioned]) -> Iterator[Section]:
    """The errors of the verification beside the thesis' own."""
    from robocal.report.cable.commissioning import commissioning_sections

    yield from commissioning_sections(made.result, made.written)
