"""Printed sheets: what stands where on them. Metres; origin in the middle of the paper, x right, y up, z out of it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from robocal._record import record
from robocal._types import Array

__all__ = ["Checker", "Marker", "Patch", "Sheet", "inner_corners", "marker_corners", "patches"]

# Top left, top right, bottom right, bottom left, of a square of edge 2.
SQUARE = np.array([[-1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, -1.0, 0.0]])


@record(eq=False)
class Marker:
    """A square marker: dictionary (6x6_250, 36h11), number, cells (n, n) with its black border (1 white, 0 black; row 0 at the top), its
    middle, and the edge of the black square; whether it is printed turned by half, as the tags of Kalibr are to those of OpenCV."""

    family: str
    id: int
    cells: Array
    x: float
    y: float
    size: float
    turned: bool = False


@record
class Checker:
    """A checkerboard of columns x rows squares around its middle; the top left square is black unless `white_first`."""

    columns: int
    rows: int
    square: float
    x: float = 0.0
    y: float = 0.0
    white_first: bool = False


@record(eq=False)
class Sheet:
    """White paper of width x height with checkerboards, single black squares (x, y, edge), and markers on top."""

    name: str
    width: float
    height: float
    markers: tuple[Marker, ...] = ()
    checkers: tuple[Checker, ...] = ()
    squares: tuple[tuple[float, float, float], ...] = ()


class Patch(NamedTuple):
    """A rectangle of equal cells (rows, columns), 1 white and 0 black, from its top left corner on."""

    left: float
    top: float
    cell: float
    values: Array


def marker_corners(marker: Marker) -> Array:
    """Corners (4, 3) of the black square: top left, top right, bottom right, bottom left, where the marker stands upright."""
    return SQUARE * (-marker.size if marker.turned else marker.size) / 2 + [marker.x, marker.y, 0.0]


def inner_corners(checker: Checker) -> Array:
    """Corners (rows - 1, columns - 1, 3) between the squares, by rows from the top left."""
    x = checker.x + (np.arange(1, checker.columns) - checker.columns / 2) * checker.square
    y = checker.y - (np.arange(1, checker.rows) - checker.rows / 2) * checker.square
    u, v = np.meshgrid(x, y)
    return np.stack([u, v, np.zeros_like(u)], axis=-1)


def patches(sheet: Sheet) -> Iterator[Patch]:
    """What is printed, in the order of printing: later patches cover earlier ones."""
    for c in sheet.checkers:
        values = (np.indices((c.rows, c.columns)).sum(axis=0) + c.white_first) % 2.0
        yield Patch(c.x - c.columns * c.square / 2, c.y + c.rows * c.square / 2, c.square, values)
    for x, y, edge in sheet.squares:
        yield Patch(x - edge / 2, y + edge / 2, edge, np.zeros((1, 1)))
    for m in sheet.markers:
        yield Patch(m.x - m.size / 2, m.y + m.size / 2, m.size / len(m.cells), np.rot90(m.cells, 2 * m.turned))
