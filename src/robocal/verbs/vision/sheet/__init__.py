"""`vision sheet`: markers and boards to print, at true scale."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from robocal._record import record
from robocal.report.sections import Section, Text
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch

if TYPE_CHECKING:
    from robocal.verbs.vision.sheet.result import Printed

__all__ = ["Options", "run", "sections"]


@record
class Options(BaseOptions):
    """Print markers or a board: a PDF at true scale, and a YAML beside it that says what stands where.

    A bar of 100 mm at its foot shows the scale of the printer. Everything is as large as the paper permits unless you say
    how large. Markers keep two cells of white around themselves.

    \b
    robocal vision sheet -o sheet.pdf
    robocal vision sheet --pattern marker --first 7 --size 100
    robocal vision sheet --pattern charuco --paper A3 --columns 8 --rows 11 --square 30
    robocal vision sheet --pattern aprilgrid --paper 600x500
    """

    pattern: str = option(
        "grid", "What to print", "PATTERN", choices=("marker", "grid", "checkerboard", "charuco", "aprilgrid")
    )
    paper: str = option("A4", "A4, A3, letter, or WIDTHxHEIGHT in mm", "PAPER")
    dictionary: str | None = option(
        None, "Dictionary of the markers, such as 6x6_250 or 36h11", "NAME", otherwise="6x6_250; 36h11 for an aprilgrid"
    )
    first: int = option(0, "Number of the first marker", "N", least=0)
    ids: tuple[str, ...] = option((), "Numbers of the markers, in place of one after the other", "IDS", listed=True)
    columns: int | None = option(None, "Markers or squares side by side", "N", least=1, most=100)
    rows: int | None = option(None, "Markers or squares one below the other", "N", least=1, most=100)
    size: float | None = option(None, "Edge of a marker's black square", "MM", unit="mm", least=1, wrong="not a length")
    square: float | None = option(None, "Edge of a square of a board", "MM", unit="mm", least=1, wrong="not a length")
    pitch: float | None = option(
        None,
        "From marker to marker of a grid",
        "MM",
        unit="mm",
        above=0,
        wrong="not a length",
        otherwise="two cells of white",
    )
    border: int | None = option(
        None,
        "Cells of black around a marker's code",
        "N",
        least=1,
        most=2,
        otherwise="1; 2 for an aprilgrid, as Kalibr has it",
    )
    output: Path = option(Path("sheet.pdf"), "The PDF; the YAML gets its name", "FILE", short="-o")
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Printed]:
    """Writes the PDF and the YAML. Raises ModelError where it does not fit, FileError for a file that exists, MissingExtra."""
    from robocal.verbs.vision.sheet.result import print_sheet

    made = print_sheet(o)
    return Outcome(made, lambda: made.document, written=made.written)


def sections(made: Outcome[Printed]) -> Iterator[Section]:
    """What is printed, and where the files are."""
    files = (Text.of(str(path), indent=2) for path in made.written)
    yield Section.of("", Text.of(made.result.summary), *files, Text.of("Print at 100 %, and measure the bar."))
