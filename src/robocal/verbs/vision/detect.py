"""`vision detect`: corners of printed targets in images."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from robocal._record import record, replace
from robocal.errors import ModelError
from robocal.report.sections import Section
from robocal.verbs import shared_options as w
from robocal.verbs.option import Arg, BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch, details, run_verb

if TYPE_CHECKING:
    from robocal.session.vision.detection import Detected

__all__ = ["Options", "details", "run", "sections"]

IMAGES = Arg("IMAGES...", "Images of one camera: files, folders, patterns, lists (.txt), videos.")


@record
class Options(BaseOptions):
    """Find printed targets in the images of one camera, and list their corners for kind: pixels.

    Targets are markers (ArUco, AprilTag; several on a sheet are a grid), a checkerboard, or a ChArUco board. A sheet
    of robocal vision sheet says all of it: --sheet. Without --sheet, --dictionary and --checker all are tried on three images.

    \b
    robocal vision detect images --sheet sheet.yaml -o corners.csv
    robocal vision detect images -o corners.csv
    robocal vision detect "cam1/*.png" --dictionary 36h11 --size 60
    robocal vision detect images --checker 10x8 --square 20 -o corners.csv
    robocal vision detect images --dictionary 36h11 --size 60 --lens lens.yaml -o corners.csv
    robocal vision detect images --charuco 5x7 --dictionary 6x6_250 --square 36 --size 18

    With -o corners.csv, corners.json and corners.html are written beside it. The middle of the first pixel is (0, 0).
    Corners of a marker: 0 top left, 1 top right, 2 bottom right, 3 bottom left.

    Exit status 3 when no image shows a target, or when the images cannot be of one camera.
    """

    images: Annotated[tuple[str, ...], IMAGES]
    sheet: Path | None = option(
        None, "The YAML of a printed sheet, or of a target of Kalibr; it says dictionary, board and sizes", "FILE"
    )
    dictionary: str | None = option(
        None, "Dictionary of the markers: 4x4_50 to 7x7_1000, 16h5, 25h9, 36h10, 36h11, mip_36h12, original", "NAME"
    )
    checker: str | None = option(None, "A checkerboard of so many squares", "COLUMNSxROWS")
    charuco: str | None = option(None, "A ChArUco board of so many squares", "COLUMNSxROWS")
    size: float | None = option(
        None, "Edge of a marker's black square, as measured on the print", "MM", unit="mm", above=0
    )
    square: float | None = option(
        None, "Edge of a square of a board, as measured on the print", "MM", unit="mm", above=0
    )
    lens: Path | None = option(
        None, "The lens, where it is known: corners are searched through it, with smaller standard deviations", "FILE"
    )
    search: str = option(
        "opencv",
        "What looks for markers; the AprilTag library needs pip install 'robocal[apriltag]'",
        "NAME",
        choices=("opencv", "apriltag"),
    )
    every: int = option(10, "Of a video, take one frame in so many", "N", least=1)
    output: Path | None = option(
        None, "Write the list here, and a document and a page beside it", "FILE.csv", short="-o"
    )
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Detected]:
    """Finds and fits corners; FILE.csv gets FILE.json and FILE.html beside it. Raises InputError."""
    from robocal.session.vision.detection import detect

    if o.output is None:
        return run_verb(o, (), lambda: detect(o, watch, command, lens=o.lens))
    if o.output.suffix.lower() != ".csv":  # --force on an image would replace it
        raise ModelError("corners are a CSV", key="--output", found=str(o.output), expected="a name that ends in .csv")
    files = tuple(o.output.with_suffix(end).name for end in (o.output.suffix, ".json", ".html"))
    beside = replace(o, output=o.output.parent)
    return run_verb(beside, files, lambda: detect(o, watch, command, files, o.lens), sections, details)


def sections(made: Outcome[Detected]) -> Iterator[Section]:
    """What was found, view by view, and what is wrong with the images."""
    from robocal.report.detected import detect_sections

    yield from detect_sections(made.result, made.written)
