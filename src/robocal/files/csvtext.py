"""The text of a CSV: from rows of any values, or from columns of text."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence

from robocal.files.text import harmless

__all__ = ["csv_columns", "csv_text"]

MARKS = (",", "\n", '"')  # what a cell holds only in quotes


def csv_text(header: Sequence[object], rows: Iterable[Sequence[object]]) -> str:
    """The text of a CSV: commas, one line per row, quoted where a cell needs it; text that a spreadsheet would run as a
    formula gets an apostrophe before it (`files.text`)."""
    return _written([harmless(cell) for cell in row] for row in (header, *rows))


def csv_columns(header: Sequence[str], columns: Sequence[Sequence[str]]) -> str:
    """The same of columns whose cells are `harmless` already."""
    # A row of one empty cell needs quotes; what a return does, the writer knows.
    if len(header) < 2 or any("\r" in "".join(cells) for cells in (header, *columns)):
        return _written((header, *zip(*columns, strict=True)))
    rows = zip(*map(_quote, columns), strict=True)
    return "\n".join(map(",".join, (_quote(header), *rows))) + "\n"


def _quote(cells: Sequence[str]) -> Sequence[str]:
    """Cells in quotes where they hold what stands between cells and lines."""
    text = "".join(cells)
    if not any(mark in text for mark in MARKS):
        return cells
    return ['"' + c.replace('"', '""') + '"' if any(mark in c for mark in MARKS) else c for c in cells]


def _written(rows: Iterable[Sequence[object]]) -> str:
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(rows)
    return stream.getvalue()
