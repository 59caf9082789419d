"""`predict`: where the tool of an identified robot is at given joint values, and how far that may be off."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from robocal._record import record, replace
from robocal.report.sections import Detail, Figure, Section, Text, ends, listing_table, quiet
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, arg, option
from robocal.verbs.outcome import Outcome, Watch

if TYPE_CHECKING:
    from robocal.session.prediction import Prediction

__all__ = ["Options", "run", "sections"]

MOST = 40


@record
class Options(BaseOptions):
    """Predict the pose of the tool at given joint values, with 95 % bands; of a cable robot its lengths at poses, or its poses at lengths.

    There are two bands: of the model's prediction, and of a new measurement there. The second adds the noise and the
    residual of the fit. Bands are those of the arm's shape; --absolute adds the uncertainty of the base's place.

    \b
    robocal predict run poses.csv
    robocal predict run poses.csv -o predicted.csv   (beside it predicted.html draws the robot at every row)
    """

    folder: Path = arg(..., "RUN", "A run folder, as identify -o writes it.")
    poses: Path = arg(
        ..., "POSES", "A CSV with units in its headers: q1 [deg], ...; of a cable robot x [m], ..., or c1 [m], ..."
    )
    absolute: bool = option(False, "Include the uncertainty of the base's place")
    output: w.OutputFile = None
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Prediction]:
    """Predicts what a CSV asks for; `output` gets the same as a CSV, with a page beside it. Raises InputError."""
    from robocal.errors import FileError
    from robocal.files.display import listing_text
    from robocal.files.writing import refuse_existing, write_files
    from robocal.report.page import page
    from robocal.session.inputs import open_machine

    if o.output is not None and o.output.suffix.lower() == ".html":
        raise FileError("the rows are written as a CSV, and the page beside it", file=o.output, expected="FILE.csv")
    for path in () if o.output is None else (o.output, o.output.with_suffix(".html")):
        refuse_existing(path, (), o.force)
    if watch:
        watch({"stage": "read"})
    found = open_machine(o.folder).predict(o.poses, o.absolute)
    if o.output is not None:
        drawn = page(found.name, sections(_outcome(found)), kind="Prediction")
        texts = {o.output.name: listing_text(found.poses), o.output.with_suffix(".html").name: drawn}
        found = replace(found, written=write_files(o.output.parent, texts))
    return _outcome(found)


def _outcome(found: Prediction) -> Outcome[Prediction]:
    return Outcome(found, lambda: found.document, found.trusted, remarks=found.warnings, written=found.written)


def sections(made: Outcome[Prediction]) -> Iterator[Section]:
    """One line per pose: where, and how far that may be off."""
    found = made.result
    yield Section.of("", Text.of((found.name, "strong"), f"   {found.what}"))
    yield Section.of("", Detail(lambda: _draw(found)), title="Machine", key="machine", brief=())
    lines = [f"... and {len(found.poses) - MOST} more; the CSV of -o FILE has all"] if len(found.poses) > MOST else []
    right = tuple(range(1, len(found.table.columns)))
    rows = replace(listing_table(found.table, most=MOST), right=right)
    yield Section.of("", rows, *quiet(*lines, found.notes), title="Predicted rows")
    yield from ends(made.remarks)
    if made.written:
        yield Section.of("", *(Text.of(f"Written: {path}") for path in made.written))


def _draw(found: Prediction) -> Iterator[Figure]:
    """The machine at every row, or at some of many."""
    from robocal.files.display import to_display
    from robocal.prove.shape import RobotShape
    from robocal.report.arrows import machine_rows

    shapes = [to_display(RobotShape, shape) for shape in found.shapes()]
    if shapes:
        some = (
            f"Of {len(found.poses)} rows {len(shapes)} are drawn, as evenly as can be."
            if len(shapes) < len(found.poses)
            else ""
        )
        yield machine_rows(shapes, [shape.configuration for shape in shapes], some)
