"""`vision map`: photographs in a map of markers that was established before."""

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

__all__ = ["Options", "details", "run", "sections"]

CORNERS = Arg("CORNERS", "corners.csv of robocal vision detect, or a table with its columns.")


@record
class Options(BaseOptions):
    """Find where the camera was, in a map of markers that was established before.

    \b
    robocal vision map corners.csv --held map.yaml --lens lens.yaml -o poses.csv
    robocal verify tracker.csv poses.csv

    Sigma of a pose holds the noise of its corners, the covariance of the map and that of the lens. An image with two poses that fit
    alike is not in the list; both are reported. With -o poses.csv, poses.json and poses.html are written beside it.

    Exit status 3 when map and lens do not fit the images.
    """

    corners: Annotated[Path, CORNERS]
    held: Path | None = option(None, "The map: map.yaml, or a file of TagSLAM, MarkerMapper or PLY", "FILE")
    lens: Path | None = option(None, "The lens: lens.yaml, or a file of OpenCV, ROS or Kalibr", "FILE")
    image: str | None = option(
        None, "Size of the images in pixels", "WIDTHxHEIGHT", otherwise="that in the JSON beside the corners"
    )
    exclude: w.Exclude = ()
    output: Path | None = option(
        None, "Write the poses here, and a document and a page beside them", "FILE.csv", short="-o"
    )
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[MapPlaces]:
    """Places images in a map; FILE.csv gets FILE.json and FILE.html beside it. Raises InputError."""
    from robocal.session.vision.map_places import find_places

    if o.held is None:
        raise ModelError("the map is not named", key="--held", expected="map.yaml")
    if o.output is None:
        return run_verb(o, (), lambda: find_places(o, watch, command))
    if o.output.suffix.lower() != ".csv":
        raise ModelError("poses are a CSV", key="--output", found=str(o.output), expected="a name that ends in .csv")
    files = tuple(o.output.with_suffix(end).name for end in (o.output.suffix, ".json", ".html"))
    beside = replace(o, output=o.output.parent)
    return run_verb(beside, files, lambda: find_places(o, watch, command, files), sections, details)


def sections(made: Outcome[MapPlaces]) -> Iterator[Section]:
    """The poses, and how well the map meets the corners."""
    from robocal.report.places_page import places_sections

    yield from places_sections(made.result, made.written)
