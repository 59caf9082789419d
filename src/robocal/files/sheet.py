"""A printed sheet as files: a PDF at true scale, and sheet.yaml, which says what stands where."""

from __future__ import annotations

import os
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import FiniteFloat

from robocal._version import __version__
from robocal.errors import FormatError, ModelError
from robocal.files.images import family_cells
from robocal.files.kalibr_board import KALIBR, kalibr_sheet
from robocal.files.pdf import Box, page_of, rectangles, text_line
from robocal.files.schema import FileModel, Name, Version, validate
from robocal.files.units import number, parse_unit
from robocal.files.yamlio import YamlDocument, flow, load, quote
from robocal.vision.layouts import MARGIN
from robocal.vision.sheets import SQUARE, Checker, Marker, Patch, Sheet, marker_corners, patches

__all__ = ["FOOT", "describe_sheet", "read_sheet", "sheet_pdf"]

FOOT = 0.022  # m, at the foot of the paper, for bar and text
BAR = 100  # mm
LINES = 3
BORDERS, SQUARES = 2, 200  # cells around a code, squares along a board: at most
LETTER = 0.56  # of the height of Helvetica's letters, the width of a wide text's


def sheet_pdf(sheet: Sheet, words: str) -> str:
    """The sheet at true scale, with a bar to check the printer's scale and the words below it."""
    width, height = 1e3 * sheet.width, 1e3 * sheet.height
    parts = [part for patch in patches(sheet) for part in ink(patch, width / 2, height / 2)]
    return page_of(width, height, [*parts, *foot(width, words)], sheet.name)


def ink(patch: Patch, x: float, y: float) -> Iterator[str]:
    """A patch from the paper's middle (x, y) in mm: white, then its black cells, those of a row that meet as one."""
    rows, columns = patch.values.shape
    left, top, cell = x + 1e3 * patch.left, y + 1e3 * patch.top, 1e3 * patch.cell
    if patch.values.any():
        yield rectangles([(left, top - rows * cell, columns * cell, rows * cell)], 1)
    steps = np.diff(np.pad(1 - patch.values, ((0, 0), (1, 1))), axis=1)
    starts, ends = np.argwhere(steps > 0), np.argwhere(steps < 0)
    runs: list[Box] = []
    for (i, a), (_, b) in zip(starts, ends, strict=True):
        runs.append((left + a * cell, top - (i + 1) * cell, (b - a) * cell, cell))
    yield rectangles(runs, 0)


def foot(width: float, words: str) -> Iterator[str]:
    """A bar of 100 mm, of 50 or less where the paper is narrow, and the words below it; mm."""
    left, length = 1e3 * MARGIN, BAR
    while length > width - 2 * left:
        length = length // 2 if length > 10 else length - 1
    base = left + 14.0
    ticks: list[Box] = [(left, base, float(length), 0.2)]
    for k in range(length + 1):
        tall = 3.0 if k % 10 == 0 else 2.2 if k % 5 == 0 else 1.5
        ticks.append((left + k - 0.075, base, 0.15, tall))
    yield rectangles(ticks, 0)
    for k in range(0, length + 1, 10):
        yield text_line(left + k + 0.3, base + 2.2, 1.6, str(k))
    said = f"{words} Print at 100 % (actual size). The bar is {length} mm long: measure it, and write what it is into sheet.yaml."
    size = 2.8
    lines = textwrap.wrap(said, int((width - 2 * left) / (size * LETTER)))
    while len(lines) > LINES and size > 0.8:
        size -= 0.2
        lines = textwrap.wrap(said, max(int((width - 2 * left) / (size * LETTER)), 8))
    for i, line in enumerate(lines):
        yield text_line(left, base - 4.0 - i * 1.4 * size, size, line)


def describe_sheet(sheet: Sheet, border: int, words: str) -> str:
    """sheet.yaml: dictionary, numbers and corners of markers, squares and checkerboards, in mm."""

    def mm(*values: float) -> str:
        return "[" + ", ".join(number(round(1e3 * v, 6) + 0.0) for v in values) + "]"

    lines = [
        f"# Printed by robocal {__version__}. {words}",
        "robocal: 1",
        "kind: sheet",
        f"name: {quote(sheet.name)}",
        "unit: mm",
        "scale: 1    # what the bar measures on the paper, over what it says",
        f"paper: {mm(sheet.width, sheet.height)}",
        "# Origin in the middle of the paper, x right, y up, z out of it.",
    ]
    if sheet.markers:
        lines += [
            f"dictionary: {flow(sheet.markers[0].family)}",
            f"border: {border}    # cells of black around the code",
        ]
        turned = " These are printed turned by half." if any(m.turned for m in sheet.markers) else ""
        said = f"# Corners of the black squares: top left, top right, bottom right, bottom left of a marker that stands upright.{turned}"
        lines += [said, "markers:"]
        for m in sheet.markers:
            corners = ", ".join(mm(x, y) for x, y, _ in marker_corners(m))
            lines.append(f"  - {{id: {m.id}, corners: [{corners}]}}")
    if sheet.checkers:
        lines.append("checkerboards:")
    for c in sheet.checkers:
        first = "white" if c.white_first else "black"
        square = number(round(1e3 * c.square, 6))
        facts = f"columns: {c.columns}, rows: {c.rows}, square: {square}, middle: {mm(c.x, c.y)}, first: {first}"
        lines.append(f"  - {{{facts}}}    # squares; the first is that at the top left")
    if sheet.squares:
        lines += ["# Black squares: middle and edge.", "squares:", *(f"  - {mm(*square)}" for square in sheet.squares)]
    return "\n".join(lines) + "\n"


class PrintModel(FileModel):
    """One marker on paper."""

    id: int
    corners: list[list[FiniteFloat]]


class BoardModel(FileModel):
    """One checkerboard on paper."""

    columns: int
    rows: int
    square: FiniteFloat
    middle: list[FiniteFloat]
    first: str = "black"


class SheetModel(FileModel):
    """sheet.yaml."""

    robocal: Version
    kind: Literal["sheet"]
    name: Name = "sheet"
    unit: str
    scale: FiniteFloat = 1.0
    paper: list[FiniteFloat]
    dictionary: str = ""
    border: int = 1
    markers: list[PrintModel] = []  # noqa: RUF012 - as pydantic has it
    checkerboards: list[BoardModel] = []  # noqa: RUF012
    squares: list[list[FiniteFloat]] = []  # noqa: RUF012


def read_sheet(path: str | os.PathLike[str]) -> Sheet:
    """The sheet of a sheet.yaml, at the scale that was measured, or of a target of Kalibr. Raises FileError, FormatError, MissingExtra."""
    if Path(path).suffix.lower() == ".csv":
        expected = "sheet.yaml of robocal vision sheet, or a target of Kalibr"
        raise FormatError("a table of values is no sheet", file=Path(path), expected=expected)
    document = load(path)
    if KALIBR in document.data:
        return kalibr_sheet(document)
    model = validate(SheetModel, document)
    document.insist(0.5 < model.scale < 2, "not a scale", ("scale",), found=model.scale, expected="about 1")
    unit = parse_unit(model.unit, "m", file=document.path, row=document.row(("unit",)), key="unit").factor * model.scale
    pair(document, model.paper, ("paper",))
    ids = [m.id for m in model.markers]
    document.insist(len(set(ids)) == len(ids), "a number stands twice", ("markers",), found=ids)
    document.insist(
        1 <= model.border <= BORDERS, "not a border", ("border",), found=model.border, expected="1 or 2 cells"
    )
    try:
        cells = family_cells(model.dictionary, ids, model.border) if ids else ()
    except ModelError as error:
        key = "markers" if error.key == "id" else "dictionary"
        raise error.of_file(document.path, key=key, row=document.row((key,))) from None
    markers = []
    for i, (m, code) in enumerate(zip(model.markers, cells, strict=True)):
        at = ("markers", i, "corners")
        square = len(m.corners) == 4 and all(len(c) == 2 for c in m.corners)
        document.insist(square, "not four corners", at, found=m.corners, expected="[[x, y], ...] from the top left on")
        corners = np.array(m.corners)
        middle, edge = corners.mean(axis=0), corners[1, 0] - corners[0, 0]
        # A negative edge is half a turn.
        right = edge != 0 and np.abs(SQUARE[:, :2] * edge / 2 + middle - corners).max() < 1e-3 * abs(edge)
        document.insist(right, "not an upright square", at, found=m.corners, expected="from the top left on, clockwise")
        place = unit * middle[0], unit * middle[1], unit * abs(edge)
        markers.append(Marker(model.dictionary, m.id, code, *place, bool(edge < 0)))
    checkers = []
    for i, c in enumerate(model.checkerboards):
        pair(document, c.middle, ("checkerboards", i, "middle"))
        good = 0 < c.columns <= SQUARES and 0 < c.rows <= SQUARES and c.square > 0 and c.first in ("black", "white")
        document.insist(
            good, "not a checkerboard", ("checkerboards", i), expected="columns, rows, square, first: black or white"
        )
        checkers.append(
            Checker(c.columns, c.rows, unit * c.square, unit * c.middle[0], unit * c.middle[1], c.first == "white")
        )
    for i, s in enumerate(model.squares):
        document.insist(len(s) == 3 and s[2] > 0, "not a square", ("squares", i), found=s, expected="[x, y, edge]")
    squares = tuple((unit * x, unit * y, unit * e) for x, y, e in model.squares)
    return Sheet(model.name, unit * model.paper[0], unit * model.paper[1], tuple(markers), tuple(checkers), squares)


def pair(document: YamlDocument, values: list[float], at: tuple[str | int, ...]) -> None:
    """Two numbers, or FormatError."""
    document.insist(len(values) == 2, "not two numbers", at, found=values, expected="[x, y]")
