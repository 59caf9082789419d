"""`vision map`: where markers are to one another; or where the camera was, in a map that was made before."""

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
    from robocal.session.vision.map_places import MapPlaces
    from robocal.session.vision.map_result import MarkerMapResult

__all__ = ["Options", "details", "run", "sections"]

OF_A_NEW_MAP = ("size", "sheet", "origin", "without", "fix", "prior", "loss")
CORNERS = Arg(
    "CORNERS", "corners.csv of robocal vision detect, a table with view, marker, corner, u, v, or a folder of images."
)


@record
class Options(BaseOptions):
    """Find where markers are to one another from images of them, with what the map may be off by. No robot is needed.

    Put markers of different numbers anywhere, and take 20 to 100 images from different sides. Every image should show
    several markers, and every marker should be in three images or more.

    \b
    robocal vision detect images --dictionary 36h11 --size 60 -o corners.csv
    robocal vision map corners.csv --lens lens.yaml --size 60 -o map.yaml
    robocal vision map images --dictionary 36h11 --lens lens.yaml --size 60 -o map.yaml
    robocal vision map corners.csv --lens lens.yaml --size 60 --size 7=120 --origin 7 -o map.yaml
    robocal vision map corners.csv --lens lens.yaml --size 60 --prior march.yaml -o june.yaml
    robocal vision map corners.csv --lens lens.yaml --held map.yaml -o poses.csv
    robocal vision map photographs --lens lens.yaml --held map.yaml -o poses.csv

    The lens stays free within what lens.yaml says of it. A file of OpenCV, ROS or Kalibr says nothing: then f and c may
    be off by 10 px, distortion by 0.1 (p1 and p2 by 0.01). So are the edges in --size, within --size-sigma and
    --size-scatter: views tell them beside one another, and sigma holds the scale that nothing else tells.

    "Located" means that views which were left out are met as well as the noise of corners allows. The origin of the
    coordinates is a marker; what the map may be off by is counted without a reference. With -o map.yaml, the covariance,
    map.json and map.html are written beside it.

    With --prior markers are believed to stand to one another as the file says, within its sigma; the file may be a TagSLAM
    file with boards. A marker that moved since is named with its distance, and nothing is believed of it.

    With --sheet the markers of a printed sheet have the sizes and places of its file, and --size is an edge as it was measured.
    A sheet says how its markers stand to one another, not how large it is: sizes do.

    With --held the map stays as it is, and the list has where the camera was in each image. Sigma of a pose holds the
    noise of its corners, the covariance of the map and that of the lens. An image with two poses that fit alike is not in
    the list; both are reported.

    Exit status 3 when the map is not located, or map and lens do not fit the images.
    """

    corners: Annotated[Path, CORNERS]
    lens: Path = option(..., "The lens of the camera: lens.yaml, or a file of OpenCV, ROS or Kalibr", "FILE")
    held: Path | None = option(
        None, "Find the camera in this map: map.yaml, or a file of TagSLAM, MarkerMapper or PLY", "FILE"
    )
    size: tuple[str, ...] = option(
        (), "Edge of the markers' black squares in mm, as measured; of some alone as 7=120", "[ID=]MM", listed=True
    )
    size_sigma: float = option(
        0.2, "What all edges in --size together may be off by, in mm: ink, paper, gauge; 0: nothing", "MM", least=0
    )
    size_scatter: float = option(
        0.3, "By how much edges differ from marker to marker, in percent; 0: not at all", "PERCENT", least=0
    )
    prior: Path | None = option(
        None, "What is known of the markers beforehand: surveyed tags, boards, the map of last month", "FILE"
    )
    sheet: tuple[Path, ...] = option(
        (), "sheet.yaml of robocal vision sheet, or a target of Kalibr; one for each sheet", "FILE"
    )
    images: tuple[str, ...] = option(
        (), "Images of a list of corners: corners are fitted again in them, with the lens of the map", "IMAGES"
    )
    dictionary: str | None = option(
        None,
        "Dictionary of the markers in images: 4x4_50 to 7x7_1000, 16h5, 25h9, 36h10, 36h11, mip_36h12, original",
        "NAME",
    )
    origin: str | None = option(
        None, "Marker in which the coordinates begin, with its axes", "ID", otherwise="the one that most views show"
    )
    without: tuple[str, ...] = option((), "Markers that are left out", "IDS", listed=True)
    fix: tuple[str, ...] = option((), "Numbers of the lens that stay as they are: k3, p1,p2", "NAMES", listed=True)
    loss: str = option(
        "huber", "Loss of the fit: huber counts what is far off less", "LOSS", choices=("huber", "none", "cauchy", "tukey"),
    )  # fmt: skip
    image: str | None = option(
        None,
        "Size of the images in pixels",
        "WIDTHxHEIGHT",
        otherwise="that of the lens, or in the JSON beside the corners",
    )
    exclude: w.Exclude = ()
    output: Path | None = option(
        None, "Write the map here, and its covariance, a document and a page beside it", "FILE.yaml", short="-o"
    )
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[MarkerMapResult | MapPlaces]:
    """Finds a map, FILE.yaml with FILE.covariance.csv, FILE.json and FILE.html beside it; or the camera in a map, FILE.csv with FILE.json
    and FILE.html. Raises InputError."""
    ends = (".csv", ".json", ".html") if o.held else (".yaml", ".covariance.csv", ".json", ".html")
    if o.held:
        for name in OF_A_NEW_MAP:
            if o.departs(name):
                raise ModelError("the map stays as it is", key=f"--{name}", found="--held", expected="one of the two")
    if o.output is not None and o.output.suffix.lower() not in ("", ends[0]):
        expected = f"a name that ends in {ends[0]}"
        raise ModelError("a list or a map has its own suffix", key="--output", found=str(o.output), expected=expected)
    place = None if o.output is None else o.output.parent
    files = () if o.output is None else tuple(o.output.with_suffix(end).name for end in ends)

    def find() -> MarkerMapResult | MapPlaces:
        if o.held:
            from robocal.session.vision.map_places import find_places

            return find_places(o, watch, command, files)
        from robocal.session.vision.map_result import find_map

        return find_map(o, watch, command, files)

    return run_verb(replace(o, output=place), files, find, sections, *([details] if files else []))


def sections(made: Outcome[MarkerMapResult | MapPlaces]) -> Iterator[Section]:
    """The verdict, how well views are met, and each marker; or the poses."""
    from robocal.session.vision.map_places import MapPlaces

    if isinstance(made.result, MapPlaces):
        from robocal.report.places_page import places_sections

        yield from places_sections(made.result, made.written)
        return
    from robocal.report.map_page import map_sections

    yield from map_sections(made.result, made.written)
