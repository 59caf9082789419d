"""`report`: the page of a folder once more, from what else is in it: a run, a validation or a verification."""

from __future__ import annotations

from pathlib import Path

from robocal._record import record
from robocal.verbs.option import BaseOptions, arg, option
from robocal.verbs.outcome import Outcome, Watch
from robocal.verbs.outcome import path_sections as sections

__all__ = ["Options", "run", "sections"]

# Documents from which a page is drawn, with its name.
PAGES = {"validation.json": "validation.html", "verify.json": "report.html"}


@record
class Options(BaseOptions):
    """Write a page again: report.html of a run folder, from result.json and the tables beside it; or that of a folder of
    `validate` or `verify`, from validation.json or verify.json."""

    folder: Path = arg(..., "RUN", "A run folder, or the folder of a validation or a verification.")
    output: Path | None = option(None, "The page", "FILE", short="-o", otherwise="the page of the folder")


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Path]:
    """Writes the page of a folder. Raises FileError or FormatError."""
    from robocal.files.runfolder import REPORT, RESULT
    from robocal.files.writing import write_text

    documents = () if (o.folder / RESULT).is_file() else PAGES
    name = next((n for n in documents if (o.folder / n).is_file()), None)
    page, own = (_page_of_run(o.folder), REPORT) if name is None else (_page_of(o.folder / name), PAGES[name])
    written = write_text(o.output or o.folder / own, page)
    return Outcome(written, lambda: {"written": str(written)}, written=(written,))


def _page_of_run(folder: Path) -> str:
    from robocal.errors import FileError
    from robocal.files.runfolder import (
        ACCURACY,
        COMPARISON,
        RESIDUALS,
        open_run,
        read_accuracy,
        read_comparison,
        read_residuals,
    )
    from robocal.report.identified import report

    found = open_run(folder)
    rows, cells, methods = found.part(RESIDUALS), found.part(ACCURACY), found.part(COMPARISON)
    if rows is None:
        raise FileError("this run has no residuals", file=folder, expected=RESIDUALS)
    accuracy = None if cells is None else read_accuracy(cells)
    compared = None if methods is None else read_comparison(methods)
    return report(found.result, read_residuals(rows), accuracy, folder, compared)


def _page_of(place: Path) -> str:
    from robocal.errors import FormatError
    from robocal.files.plain import plain
    from robocal.files.schema import read_document
    from robocal.files.validation import ValidationDocument
    from robocal.files.verification import SummaryDocument, VerifyDocument
    from robocal.files.yamlio import read_json
    from robocal.report.page import page
    from robocal.report.validation import validation_head, validation_sections
    from robocal.report.verification import verification_head, verification_sections

    found: ValidationDocument | VerifyDocument | SummaryDocument
    try:
        if place.name == "validation.json":
            found = read_document(place, ValidationDocument)
            head, told = validation_head(found), validation_sections(found)
        else:
            summary = "groups" in read_json(place, "this is not a document of robocal", "an object").data
            found = read_document(place, SummaryDocument) if summary else read_document(place, VerifyDocument)
            head, told = verification_head(), verification_sections(found)
        return page(sections=told, recipe=plain(found.provenance), **head)
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        # Columns of several lengths, words for numbers: somebody has changed it.
        raise FormatError("this document does not hold what its page draws", file=place, found=str(error)) from None
