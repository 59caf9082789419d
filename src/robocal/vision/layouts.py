"""Layouts of printed sheets: single markers, grids of markers, checkerboards, ChArUco boards, AprilGrids, and how large they may be.

The size is the edge of a marker, of boards with squares that of a square. Every layout keeps white around itself: two cells of a marker,
half a square of a board.
"""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.errors import ModelError, require
from robocal.vision.sheets import Checker, Marker, Sheet

__all__ = ["MARGIN", "PATTERNS", "SheetLayout", "compose", "largest"]

PATTERNS = ("marker", "grid", "checkerboard", "charuco", "aprilgrid")
MARGIN = 0.010  # m, at the rim of the paper, which printers leave white
QUIET = 2  # cells of white around a marker
GAP = 0.3  # of a marker's edge between markers of an AprilGrid, as Kalibr has it
STEP = 0.0005  # m, between sizes that are tried


@record
class SheetLayout:
    """A pattern of columns x rows; `cells`: along a marker with its black border; pitch: between middles of a grid's markers, and marker:
    edge of those of a ChArUco board (m); where nothing is said as their white asks for."""

    pattern: str
    columns: int
    rows: int
    cells: int = 0
    pitch: float | None = None
    marker: float | None = None

    def spacing(self, size: float) -> float:
        """Between middles of neighbours (m)."""
        if self.pattern in ("checkerboard", "charuco"):
            return size
        if self.pattern == "aprilgrid":
            return size * (1 + GAP)
        return size * (1 + QUIET / self.cells) if self.pitch is None else self.pitch

    def quiet(self, size: float) -> float:
        """White around everything (m)."""
        return size / 2 if self.pattern in ("checkerboard", "charuco") else QUIET * size / self.cells

    def extent(self, size: float) -> Array:
        """Width and height of all that is black (m)."""
        rim = {"aprilgrid": size * (1 + 2 * GAP)}.get(self.pattern, size)
        return (np.array([self.columns, self.rows]) - 1) * self.spacing(size) + rim

    def fits(self, size: float, room: Array) -> bool:
        """Whether it fits into paper (width, height) of which the margins are taken already, with white around itself."""
        white = max(2 * self.quiet(size) - 2 * MARGIN, 0.0), max(self.quiet(size) - MARGIN, 0.0) + self.quiet(size)
        return bool((self.extent(size) + white <= room + 1e-9).all())  # tolerance: of arithmetic


def largest(layout: SheetLayout, room: Array) -> float:
    """The largest size (m) that fits, in steps of half a millimetre; 0 where none does. A given pitch bounds it too."""
    sizes = np.arange(1, int(max(room) / STEP) + 1)[::-1] * STEP
    return next((float(s) for s in sizes if layout.fits(s, room) and not too_dense(layout, float(s))), 0.0)


def too_dense(layout: SheetLayout, size: float) -> bool:
    """Whether a given pitch leaves less than two cells of white between markers."""
    alone = layout.columns == layout.rows == 1
    return not alone and layout.pitch is not None and layout.pitch < size * (1 + QUIET / layout.cells) - 1e-9


def compose(
    name: str,
    layout: SheetLayout,
    size: float,
    paper: tuple[float, float],
    foot: float,
    family: str,
    ids: Array,
    cells: Array,
) -> Sheet:
    """The sheet (m) on paper of width and height whose lowest `foot` is for text; ids (m,) and cells (m, n, n) of its markers.

    Markers are numbered by rows from the top left; those of an AprilGrid from the bottom left, and turned by half, as Kalibr has them.
    Raises ModelError with the largest size that fits.
    """
    if too_dense(layout, size):
        found, least = f"{1e3 * layout.spacing(size):g} mm", 1e3 * size * (1 + QUIET / layout.cells)
        expected = f"at least {least:.4g} mm for markers of {1e3 * size:g} mm"
        raise ModelError(
            "this pitch leaves less than two cells of white", key="--pitch", found=found, expected=expected
        )
    room = np.array(paper) - 2 * MARGIN - [0, foot]
    most = largest(layout, room)
    if not 0 < size <= most + 1e-9:  # tolerance: of arithmetic
        expected = f"at most {1e3 * most:g} mm" if most else "larger paper, or fewer columns and rows"
        what = "square" if layout.pattern in ("checkerboard", "charuco") else "marker"
        found = f"{layout.columns} x {layout.rows} of {1e3 * size:g} mm"
        raise ModelError(f"{what}s of this size do not fit on the paper", found=found, expected=expected)
    top = paper[1] / 2 - max(MARGIN, layout.quiet(size))
    low = -paper[1] / 2 + MARGIN + foot + layout.quiet(size)
    middle = (top + low) / 2
    step = layout.spacing(size)
    x = (np.arange(layout.columns) - (layout.columns - 1) / 2) * step
    y = middle - (np.arange(layout.rows) - (layout.rows - 1) / 2) * step
    checkers, squares = [], []
    edge = size
    if layout.pattern in ("checkerboard", "charuco"):
        checkers.append(Checker(layout.columns, layout.rows, size, 0.0, middle))
    if layout.pattern == "aprilgrid":
        y = y[::-1]
        across, along = (np.append(at - step / 2, at[-1] + step / 2) for at in (x, np.sort(y)))
        squares = [(float(u), float(v), GAP * size) for v in along for u in across]
    places = [(u, v) for v in y for u in x]
    if layout.pattern == "charuco":
        widest = size / (1 + 2 * QUIET / layout.cells)
        edge = widest if layout.marker is None else layout.marker
        message = "markers of this size leave less than two cells of white in their squares"
        require(
            0 < edge <= widest + 1e-9, message, found=f"{1e3 * edge:g} mm", expected=f"at most {1e3 * widest:.4g} mm"
        )
        places = [(u, v) for i, v in enumerate(y) for j, u in enumerate(x) if (i + j) % 2]
    made = zip(ids, cells, places if len(ids) else [], strict=True)
    turned = layout.pattern == "aprilgrid"
    markers = tuple(Marker(family, int(i), c, float(u), float(v), edge, turned) for i, c, (u, v) in made)
    return Sheet(name, paper[0], paper[1], markers, tuple(checkers), tuple(squares))
