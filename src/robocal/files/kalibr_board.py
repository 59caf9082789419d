"""Targets of Kalibr: aprilgrid.yaml and checkerboard.yaml, as sheets.

An AprilGrid has tags 36h11 with two cells of black around the code, numbered by rows from the bottom left; `tagSpacing` is the gap between
two tags, as a share of `tagSize`, and the edge of the black squares at their corners. Kalibr's tags are OpenCV's turned by half.
A checkerboard is told by its inner corners. Source: Kalibr, wiki page "calibration targets", and the program that draws them.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import PositiveFloat, PositiveInt

from robocal.errors import ModelError
from robocal.files.images import family_cells
from robocal.files.schema import FileModel, validate
from robocal.files.yamlio import YamlDocument
from robocal.vision.sheets import Checker, Marker, Sheet

__all__ = ["KALIBR", "kalibr_sheet"]

KALIBR = "target_type"
FAMILY, BORDER = "36h11", 2
MOST = 200  # squares or tags along a side
EVEN = 1e-6  # tolerance: of the edges of a square, which files round


class AprilGridModel(FileModel):
    """aprilgrid.yaml, lengths in m."""

    target_type: Literal["aprilgrid"]
    tagCols: PositiveInt
    tagRows: PositiveInt
    tagSize: PositiveFloat
    tagSpacing: PositiveFloat
    codeOffset: int = 0


class CheckerboardModel(FileModel):
    """checkerboard.yaml, lengths in m."""

    target_type: Literal["checkerboard"]
    targetCols: PositiveInt
    targetRows: PositiveInt
    rowSpacingMeters: PositiveFloat
    colSpacingMeters: PositiveFloat


def kalibr_sheet(document: YamlDocument) -> Sheet:
    """The sheet that a target.yaml of Kalibr describes, about its own middle. Raises FormatError, MissingExtra."""
    kind = document.data[KALIBR]
    document.insist_known(kind, ("aprilgrid", "checkerboard"), "this target of Kalibr is not read", (KALIBR,))
    return _grid(document) if kind == "aprilgrid" else _board(document)


def _grid(document: YamlDocument) -> Sheet:
    m = validate(AprilGridModel, document)
    for key, count in (("tagCols", m.tagCols), ("tagRows", m.tagRows)):
        document.insist(count <= MOST, "not a grid of tags", (key,), found=count, expected=f"at most {MOST}")
    document.insist(
        m.tagSpacing < 1,
        "not a share of tagSize",
        ("tagSpacing",),
        found=m.tagSpacing,
        expected="gap / tagSize, as 0.3",
    )
    ids = [m.codeOffset + k for k in range(m.tagCols * m.tagRows)]
    try:
        cells = family_cells(FAMILY, ids, BORDER)
    except ModelError as error:
        raise error.of_file(document.path, key="tagCols", row=document.row(("tagCols",))) from None
    pitch = m.tagSize * (1 + m.tagSpacing)
    x, y = ((np.arange(n) - (n - 1) / 2) * pitch for n in (m.tagCols, m.tagRows))
    places = [(float(u), float(v)) for v in y for u in x]
    markers = tuple(
        Marker(FAMILY, i, c, *at, m.tagSize, turned=True) for i, c, at in zip(ids, cells, places, strict=True)
    )
    across, along = (np.append(at - pitch / 2, at[-1] + pitch / 2) for at in (x, y))
    squares = tuple((float(u), float(v), m.tagSpacing * m.tagSize) for v in along for u in across)
    width, height = (pitch * n + 3 * m.tagSpacing * m.tagSize for n in (m.tagCols, m.tagRows))
    return Sheet("aprilgrid", width, height, markers, squares=squares)


def _board(document: YamlDocument) -> Sheet:
    m = validate(CheckerboardModel, document)
    even = abs(m.rowSpacingMeters - m.colSpacingMeters) <= EVEN * m.rowSpacingMeters
    found = f"{1e3 * m.colSpacingMeters:g} x {1e3 * m.rowSpacingMeters:g} mm"
    document.insist(even, "rectangles are no squares", ("rowSpacingMeters",), found=found, expected="equal spacings")
    for key, count in (("targetCols", m.targetCols), ("targetRows", m.targetRows)):
        document.insist(count < MOST, "not the corners of a board", (key,), found=count, expected=f"below {MOST}")
    columns, rows, edge = m.targetCols + 1, m.targetRows + 1, m.rowSpacingMeters
    return Sheet("checkerboard", (columns + 1) * edge, (rows + 1) * edge, (), (Checker(columns, rows, edge),))
