"""What `vision sheet` prints, from its options."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record
from robocal.errors import ModelError, one_of
from robocal.files.display import in_units
from robocal.files.images import family_cells
from robocal.files.parts import Document
from robocal.files.sheet import FOOT, describe_sheet, sheet_pdf
from robocal.files.units import Units
from robocal.files.writing import refuse_existing, write_files
from robocal.quantities import Column, Listing
from robocal.vision.layouts import MARGIN, SheetLayout, compose, largest
from robocal.vision.sheets import Sheet

__all__ = ["Printed", "SheetDocument", "print_sheet"]

PAPERS = {"A4": (210.0, 297.0), "A3": (297.0, 420.0), "letter": (215.9, 279.4)}  # mm
GRIDS = {"marker": (1, 1), "grid": (4, 5), "checkerboard": (6, 9), "charuco": (5, 7), "aprilgrid": (6, 6)}
BOARDS = {"checkerboard": 4, "charuco": 3}  # tolerance: squares along a board, as `detect` has it


@record(kw_only=True)
class SheetDocument(Document):
    """What --json prints; markers by number, with the middle and the edge of their black squares."""

    pattern: str
    summary: str
    markers: Listing
    written: tuple[str, ...]


@record
class Printed:
    """The sheet, what it says of itself, and its files."""

    pattern: str
    sheet: Sheet
    summary: str
    written: tuple[Path, ...]

    @property
    def document(self) -> SheetDocument:
        """For machines."""
        m = self.sheet.markers
        places = (Column(n, "m", np.array([getattr(k, n) for k in m])) for n in ("x", "y", "size"))
        listing = in_units(Listing((Column("id", "", [k.id for k in m]), *places)), Units())
        files = tuple(str(p) for p in self.written)
        return SheetDocument(
            warnings=[], remarks=[], pattern=self.pattern, summary=self.summary, markers=listing, written=files
        )


def print_sheet(o: Any) -> Printed:
    """Writes the PDF, and the YAML of its name. Raises ModelError, FileError, MissingExtra."""
    beside = o.output.with_suffix(".yaml")
    if o.output.suffix.lower() != ".pdf":
        raise ModelError("a sheet is a PDF", key="--output", found=str(o.output), expected="a name that ends in .pdf")
    _refuse_strangers(o)
    for file in (o.output, beside):
        refuse_existing(file, (), o.force)
    columns, rows = GRIDS[o.pattern]
    columns, rows = o.columns or columns, o.rows or rows
    least = BOARDS.get(o.pattern, 1)
    if min(columns, rows) < least:
        message, expected = "this is no board that can be found", f"at least {least} columns and rows"
        raise ModelError(message, key="--pattern", found=f"{columns} x {rows} squares", expected=expected)
    kalibr = o.pattern == "aprilgrid"
    family, border = o.dictionary or ("36h11" if kalibr else "6x6_250"), o.border or (2 if kalibr else 1)
    count = {"checkerboard": 0, "charuco": columns * rows // 2}.get(o.pattern, columns * rows)
    ids = _numbers(o, count)
    cells = family_cells(family, ids, border) if count else np.empty((0, 0, 0))
    given = [None if v is None else v / 1e3 for v in (o.pitch, o.size, o.square)]
    pitch, size, square = given
    layout = SheetLayout(o.pattern, columns, rows, cells.shape[-1] if count else 0, pitch, size)
    main = square if o.pattern in BOARDS else size
    paper = _paper(o.paper, layout)
    if main is None:
        main = largest(layout, np.array(paper) - 2 * MARGIN - [0, FOOT])
    sheet = compose(o.pattern, layout, main, paper, FOOT, family, np.array(ids), cells)
    words = _words(layout, sheet, main, border)
    texts = {o.output.name: sheet_pdf(sheet, words), beside.name: describe_sheet(sheet, border, words)}
    return Printed(o.pattern, sheet, words, write_files(o.output.parent, texts))


def _refuse_strangers(o: Any) -> None:
    """Options that mean nothing for a pattern."""
    message = f"{o.pattern} has no such option"
    none = {
        "marker": ("columns", "rows", "square", "pitch"), "grid": ("square",), "charuco": ("pitch",), "aprilgrid": ("square", "pitch"),
        "checkerboard": ("dictionary", "first", "ids", "size", "pitch", "border"),
    }[o.pattern]  # fmt: skip
    o.refuse(none, message, "another pattern")
    if o.ids and o.departs("first"):
        raise ModelError("numbers are given twice", key="--first", found=o.first, expected="--ids or --first")


def _numbers(o: Any, count: int) -> list[int]:
    if not o.ids:
        return list(range(o.first, o.first + count))
    if not all(word.isascii() and word.isdigit() for word in o.ids):
        raise ModelError("not numbers of markers", key="--ids", found=", ".join(o.ids), expected="such as 3,7,12")
    ids = [int(word) for word in o.ids]
    if len(set(ids)) != len(ids) or len(ids) != count:
        expected = f"{count} different numbers"
        raise ModelError("other numbers than markers", key="--ids", found=", ".join(o.ids), expected=expected)
    return ids


def _paper(words: str, layout: SheetLayout) -> tuple[float, float]:
    """Width and height in m; a named paper lies across where the layout gets larger so."""
    known = {name.lower(): size for name, size in PAPERS.items()}
    match = re.fullmatch(r"(\d+(?:\.\d+)?)\s*x\s*(\d+(?:\.\d+)?)(?:\s*mm)?", words.strip().lower())
    if match:
        width, height = (float(v) / 1e3 for v in match.groups())
        if 0.03 <= width <= 5 and 0.03 <= height <= 5:
            return width, height
        raise ModelError("not a size of paper", key="--paper", found=words, expected="30 to 5000 mm")
    if words.strip().lower() not in known:
        expected = one_of(words, (*PAPERS, "WIDTHxHEIGHT in mm"))
        raise ModelError("unknown paper", key="--paper", found=words, **expected)
    width, height = (v / 1e3 for v in known[words.strip().lower()])
    rooms = [np.array(p) - 2 * MARGIN - [0, FOOT] for p in ((width, height), (height, width))]
    return (height, width) if largest(layout, rooms[1]) > largest(layout, rooms[0]) else (width, height)


def _words(layout: SheetLayout, sheet: Sheet, size: float, border: int) -> str:
    """What is printed, in a sentence."""
    across, along = 1e3 * layout.extent(size)
    grid = f"{layout.columns} x {layout.rows}"
    parts = [layout.pattern if layout.pattern == "marker" else f"{layout.pattern} {grid}"]
    if layout.pattern in BOARDS:
        parts.append(f"squares {1e3 * size:.6g} mm")
    if sheet.markers:
        ids = [m.id for m in sheet.markers]
        row = ids == list(range(ids[0], ids[0] + len(ids)))
        numbers = f"{ids[0]} to {ids[-1]}" if row and len(ids) > 1 else ", ".join(map(str, ids))
        parts.append(f"dictionary {sheet.markers[0].family}, border {border}, ids {numbers}")
        parts.append(f"markers {1e3 * sheet.markers[0].size:.6g} mm")
    if layout.pattern in ("grid", "aprilgrid"):
        parts.append(f"pitch {1e3 * layout.spacing(size):.6g} mm")
    return f"{', '.join(parts)}; black from side to side {across:.6g} mm, from top to bottom {along:.6g} mm."
