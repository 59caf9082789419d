"""Printed sheets as what is known of markers beforehand: how those of one sheet stand to one another, but for their scale.

Sizes tell the scale (`map_sizes`): a printer, or a caliper, errs in edges and distances alike, so a sheet says nothing new of it. Beside
that a sheet is flat and printed as its file has it, within what paper does:

    C = scale^2 p p^T + diag(place^2, place^2, bend^2, tilt^2, tilt^2, turn^2)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from robocal._record import record, replace
from robocal.errors import ModelError
from robocal.files.sheet import read_sheet
from robocal.vision.map_gauge import project_covariance
from robocal.vision.maps import MarkerMap

__all__ = ["PrintedSheets", "read_sheets"]

SCALE = 0.05  # tolerance: of a sheet: far more than a printer is off by, so that sizes alone tell the scale
PLACE, BEND = 2e-4, 2e-3  # tolerance: m: of ink in the plane, and of paper on a table or a wall out of it
TILT, TURN = 0.03, 3e-3  # tolerance: rad: of paper that bends so much over a marker, and of ink across one
UNLIKE = 0.1  # tolerance: of an edge: a sheet that is printed to fit the page is smaller by 3 to 6 %


@record(eq=False)
class PrintedSheets:
    """Sheets as maps of their markers, whose names are their numbers; the edges (mm) of these; and their dictionary."""

    maps: tuple[MarkerMap, ...] = ()
    sizes: Mapping[str, float] | None = None
    family: str | None = None


def read_sheets(places: Sequence[Path], usual: float | None, own: Mapping[str, float]) -> PrintedSheets:
    """Sheets at the scale of the edge that is told of their markers (mm), of all or of single ones; else as their files have them. Raises
    FileError, FormatError, ModelError."""
    maps: list[MarkerMap] = []
    for place in places:
        sheet = read_sheet(place)
        if not sheet.markers:
            expected = "a sheet of markers; checkerboards have no numbers, robocal vision intrinsics takes them"
            raise ModelError("a sheet without markers", key="--sheet", found=place.name, expected=expected)
        names = tuple(str(m.id) for m in sheet.markers)
        for other in maps:
            if again := [n for n in names if n in other.names]:
                found, expected = (
                    f"{', '.join(again[:8])} in {place.name} and {other.source}",
                    "sheets whose numbers differ: --first",
                )
                raise ModelError("two sheets have one marker", key="--sheet", found=found, expected=expected)
            if other.family != sheet.markers[0].family:
                raise ModelError(
                    "sheets of two dictionaries", key="--sheet", found=sheet.markers[0].family, expected=other.family
                )
        printed = np.array([m.size for m in sheet.markers])
        told = [1e-3 * own[n] / s if n in own else None for n, s in zip(names, printed.tolist(), strict=True)]
        some = [t for t in told if t is not None] or ([] if usual is None else [1e-3 * usual / float(printed[0])])
        scale = float(np.mean(some)) if some else 1.0
        if abs(np.log(scale)) > UNLIKE:
            found = f"{1e3 * scale * printed[0]:g} mm beside {1e3 * printed[0]:g} mm in {place.name}"
            expected = "the edge as measured; of a sheet with other edges as MARKER=MM"
            raise ModelError("another size than that of the sheet", key="--size", found=found, expected=expected)
        vector = np.zeros((len(names), 6))
        vector[:, :2] = scale * np.array([(m.x, m.y) for m in sheet.markers])
        vector[:, 5] = [np.pi if m.turned else 0.0 for m in sheet.markers]
        bare = MarkerMap(names, scale * printed, vector, None, sheet.markers[0].family, place.name)
        wide = np.zeros((len(names), 6))
        wide[:, :3] = SCALE * (vector[:, :3] - vector[:, :3].mean(axis=0))
        spread = np.outer(wide.ravel(), wide.ravel())
        spread += np.diag(np.tile(np.square([PLACE, PLACE, BEND, TILT, TILT, TURN]), len(names)))
        maps.append(replace(bare, covariance=project_covariance(bare, spread)))
    sizes = {n: 1e3 * s for m in maps for n, s in zip(m.names, m.size.tolist(), strict=True)}
    return PrintedSheets(tuple(maps), {**sizes, **own}, maps[0].family if maps else None)
