"""`vision intrinsics`: a lens from corners."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from robocal._record import record, replace
from robocal.report.sections import Section
from robocal.verbs import shared_options as w
from robocal.verbs.option import Arg, BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch, details, run_verb

if TYPE_CHECKING:
    from robocal.session.vision.lens_result import Intrinsics

__all__ = ["Options", "details", "run", "sections"]

CORNERS = Arg("CORNERS", "corners.csv of robocal vision detect, or a table with its columns.")


@record
class Options(BaseOptions):
    """Find a camera's lens from the corners of a board or of sheets of markers, with what it may be off by.

    No robot is needed: in every view the target may be anywhere. Take 15 to 40 views, tilted by 20 to 45 deg in different
    directions, near and far, and bring the target into all corners of the image.

    \b
    robocal vision detect images --checker 10x8 --square 20 -o corners.csv
    robocal vision intrinsics corners.csv -o lens.yaml
    robocal vision intrinsics corners.csv --images images -o lens.yaml
    robocal vision intrinsics corners.csv --lens lens.yaml
    robocal vision intrinsics table.csv --image 1920x1080 --checker 10x8 --square 20

    "Improved" means better on views that were left out than the lens of --lens; without one, than the plain camera: f as long as
    the image is wide, c in its middle, no distortion. With -o lens.yaml, lens.json and lens.html are written beside it.

    Exit status 3 when the lens did not improve, or must not be used.
    """

    corners: Annotated[Path, CORNERS]
    model: str | None = option(
        None, "Model of the lens", "MODEL", choices=("brown", "rational", "fisheye"), otherwise="that of --lens; brown"
    )
    lens: Path | None = option(
        None, "The lens that is known so far: lens.yaml, or a file of OpenCV, ROS or Kalibr", "FILE"
    )
    fix: tuple[str, ...] = option((), "Numbers of the lens that stay as they are: k3, p1,p2", "NAMES", listed=True)
    size: float | None = option(
        None, "Edge of a marker's black square, as measured on the print", "MM", unit="mm", above=0
    )
    square: float | None = option(
        None, "Edge of a square of a board, as measured on the print", "MM", unit="mm", above=0
    )
    checker: str | None = option(
        None, "Squares of a checkerboard whose corners have numbers, but no places", "COLUMNSxROWS"
    )
    sheet: Path | None = option(None, "sheet.yaml of robocal vision sheet: where its markers are", "FILE")
    image: str | None = option(
        None, "Size of the images in pixels", "WIDTHxHEIGHT", otherwise="that in the JSON beside the corners"
    )
    images: tuple[str, ...] = option(
        (), "Images of the corners, as for detect: corners are fitted again in them, with the lens", "IMAGES"
    )
    exclude: w.Exclude = ()
    output: Path | None = option(
        None, "Write the lens here, and a document and a page beside it", "FILE.yaml", short="-o"
    )
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Intrinsics]:
    """Finds a lens; FILE.yaml gets FILE.json and FILE.html beside it. Raises InputError."""
    from robocal.session.vision.lens_result import find_lens

    if o.output is None:
        return run_verb(o, (), lambda: find_lens(o, watch, command), sections)
    files = tuple(o.output.with_suffix(end).name for end in (o.output.suffix or ".yaml", ".json", ".html"))
    beside = replace(o, output=o.output.parent)
    return run_verb(beside, files, lambda: find_lens(o, watch, command, files), sections, details)


def sections(made: Outcome[Intrinsics]) -> Iterator[Section]:
    """The verdict, the numbers, and how well each view is met."""
    from robocal.report.lens_page import lens_sections

    yield from lens_sections(made.result, made.written)
