"""`vision compare`: how several maps of the same markers scatter."""

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
    from robocal.session.vision.map_repeats import ComparedMaps

__all__ = ["Options", "details", "run", "sections"]

FILES = ("maps.json", "markers.csv", "distance.svg", "axes.svg", "report.html")
MAPS = Arg("MAPS...", "Maps of the same markers: map.yaml, or files of TagSLAM, MarkerMapper, PLY; two or more.")


@record
class Options(BaseOptions):
    """Compare maps of the same markers: how repeatable they are, and whether their sigma predicted as much.

    The maps are aligned on all markers that all of them have. The scatter of each marker is listed along the axes of the reference
    marker, beside its distance from it and the predicted scatter. A marker that moved between two maps is named with its distance.

    \b
    robocal vision compare monday.yaml tuesday.yaml friday.yaml
    robocal vision compare march.yaml june.yaml --reference 12 -o compared
    """

    maps: Annotated[tuple[Path, ...], MAPS]
    reference: str | None = option(
        None,
        "The marker whose axes are taken, and from which distances count",
        "MARKER",
        otherwise="the first of the first map",
    )
    output: Path | None = option(None, f"Write {', '.join(FILES[:-1])} and {FILES[-1]} here", "DIR", short="-o")
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[ComparedMaps]:
    """Compares maps; a folder gets the document, a table, two pictures and a page. Raises InputError."""
    from robocal.session.vision.map_repeats import find_scatter

    return run_verb(o, FILES, lambda: find_scatter(o, command), sections, details)


def sections(made: Outcome[ComparedMaps]) -> Iterator[Section]:
    """How the maps scatter, and which markers moved."""
    from robocal.report.repeats_page import compare_sections

    yield from compare_sections(made.result, made.written)
