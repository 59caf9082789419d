"""`vision require`: what a map of markers, and a camera in it, will be off by, before anything is printed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from robocal._record import record
from robocal.report.sections import Section
from robocal.verbs import shared_options as w
from robocal.verbs.option import Arg, BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch, details, run_verb

if TYPE_CHECKING:
    from robocal.session.vision.map_plans import MapPlans

__all__ = ["Options", "details", "run", "sections"]

FILES = ("require.json", "markers.csv", "report.html")
POSES = Arg(
    "POSES", "CSV of places of the camera in the frame of the map: x, y, z and rx, ry, rz, or qx to qw; z looks ahead."
)


@record
class Options(BaseOptions):
    """Predict the errors of a map of markers, and of a camera in it, before anything is printed: along x and y, and along z.

    Markers are those of --map, or a grid over --field. With several --size, --height or --tilt every combination is a row.
    Every second marker is raised by --height. --survey says to what each marker's place is measured by other means.

    \b
    robocal vision require poses.csv --lens lens.yaml --field 4200x3400 --grid 12x9 --size 150
    robocal vision require poses.csv --lens lens.yaml --field 4200x3400 --grid 12x9 --size 150,300 --height 0,300
    robocal vision require poses.csv --lens lens.yaml --map map.yaml --accuracy 2

    A marker counts where the image shows it whole, at least 20 px large and at most 65 degrees from its front. The
    lens may be off by what its file says of it. A file without sigma says nothing: then f and c may be off by 10 px,
    distortion by 0.1 (p1 and p2 by 0.01).

    Exit status 3 when no row reaches --accuracy.
    """

    poses: Annotated[Path, POSES]
    lens: Path = option(..., "The lens of the camera: lens.yaml, or a file of OpenCV, ROS or Kalibr", "FILE")
    map: Path | None = option(
        None, "Where the markers will be: map.yaml, or a file of TagSLAM, MarkerMapper or PLY", "FILE"
    )
    grid: str | None = option(None, "Number of markers along x and y, in place of --map", "COLUMNSxROWS")
    field: str | None = option(None, "Width and depth of the grid in mm, between middles of markers", "WIDTHxDEPTH")
    size: tuple[str, ...] = option(
        (), "Edge of the markers' black squares in mm", "MM", listed=True, otherwise="that of --map"
    )
    height: tuple[str, ...] = option(
        (), "By how much every second marker is raised, in mm", "MM", listed=True, otherwise="0"
    )
    tilt: tuple[str, ...] = option((), "By how much each marker is tilted, in deg", "DEG", listed=True, otherwise="0")
    survey: float | None = option(
        None, "Standard deviation to which each marker's place is measured by other means", "MM", unit="mm", above=0,
        otherwise="not measured",
    )  # fmt: skip
    sigma: float = option(0.3, "Standard deviation of a corner in an image", "PX", unit="px", above=0)
    accuracy: float | None = option(
        None, "The required error of the camera's place, rms of one axis", "MM", unit="mm", above=0
    )
    image: str | None = option(None, "Size of the images in pixels", "WIDTHxHEIGHT", otherwise="that of the lens")
    output: Path | None = option(None, f"Write {', '.join(FILES[:-1])} and {FILES[-1]} here", "DIR", short="-o")
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[MapPlans]:
    """Predicts maps; a folder gets the document, the markers of the first row, and a page. Raises InputError."""
    from robocal.session.vision.map_plans import predict_plans

    return run_verb(o, FILES, lambda: predict_plans(o, watch, command), sections, details)


def sections(made: Outcome[MapPlans]) -> Iterator[Section]:
    """The errors of every plan, and what would help."""
    from robocal.report.plans_page import plans_sections

    yield from plans_sections(made.result, made.written)
