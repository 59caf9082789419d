"""`vision probe`: the calibration of an ultrasound probe by PLUS as files that `identify` reads."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from robocal._record import record
from robocal.report.sections import Section, Text
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, arg, option
from robocal.verbs.outcome import Outcome, Watch

if TYPE_CHECKING:
    from robocal.files.plus import ProbeFiles

__all__ = ["Options", "run", "sections"]


@record
class Options(BaseOptions):
    """Read points of an N-wire phantom in ultrasound images, with tracked poses of the probe, as PLUS (fCal) writes them.

    The folder gets a rig whose poses are known, and a data file with its table for calibration and validation. `identify` finds the image
    plane with the sizes of a pixel.

    \b
    robocal vision probe res.xml conf.xml -o probe
    robocal identify probe/robot.yaml probe/calibration.yaml -o run
    robocal validate run probe/validation.yaml
    """

    results: Path = arg(..., "RESULT", "The result of fCal: <ProbeCalibrationResult>.")
    configuration: Path = arg(
        ..., "CONFIG", "Its configuration, with the wires and the place of the phantom: <PlusConfiguration>."
    )
    output: Path = option(Path("."), "Folder for the files", "DIR", short="-o")
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[ProbeFiles]:
    """Writes robot.yaml, and a data file with its table for each part. Raises FileError or FormatError, and writes nothing then."""
    from robocal.files.plus import read_plus
    from robocal.files.writing import refuse_existing, write_files

    made = read_plus(o.results, o.configuration)
    refuse_existing(o.output, list(made.texts), o.force)
    written = write_files(o.output, made.texts)
    document = {
        "images": made.images, "left_out": made.left_out, "points": made.points, "wires": list(made.wires),
        "pixel": {"value": list(made.pixel), "unit": "mm"}, "written": [str(p) for p in written],
    }  # fmt: skip
    return Outcome(made, lambda: document, written=written)


def sections(made: Outcome[ProbeFiles]) -> Iterator[Section]:
    """What was read, the files, and what to do next."""
    found = made.result
    images = ", ".join(f"{n} of {part}" for part, n in found.images.items())
    lost = sum(found.left_out.values())
    left = f"; {lost} without points or a tracked pose are left out" if lost else ""
    robot, *rest = made.written
    data = next(p for p in rest if p.suffix == ".yaml")
    yield Section.of(
        "",
        Text.of(f"{found.points} points of {len(found.wires)} wires in images: {images}{left}"),
        *(Text.of(str(path), indent=2) for path in made.written),
        Text.of(
            f"State how well the phantom is known in {data}, then: robocal identify {quote(str(robot))} {quote(str(data))}"
        ),
    )
