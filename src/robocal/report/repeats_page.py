"""The page of compared maps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import replace
from robocal.report.map_scatter import draw_axes, draw_distances
from robocal.report.map_scene import draw_map
from robocal.report.sections import Figure, Section, Text, ends, figure, listing_table, quiet

__all__ = ["compare_pictures", "compare_sections"]

BRIEF = 12  # markers that a terminal lists
SHORT = 5  # columns for which it has room


def compare_sections(made: Any, written: Sequence[Path]) -> Iterator[Section]:
    """The scatter as a whole, marker by marker, and markers that moved."""
    found = made.comparison
    each = 1e3 * np.sqrt(np.mean(np.square(found.deviation), axis=0))
    words = ", ".join(f"{a} {figure(float(v), 3)}" for a, v in zip("xyz", each, strict=True))
    yield Section.of(
        "",
        Text.of(
            (f"{figure(float(np.linalg.norm(each)), 3)} mm", "strong"),
            f"   scatter of a marker ({words} mm), {len(found.maps)} maps",
        ),
        *_prediction(made),
        *quiet(f"aligned on {len(found.names)} markers; axes and distances are those of marker {found.reference}"),
    )
    if made.moved:
        yield Section.of("", listing_table(made.shifts), title="Markers that moved", key="moved")
    table = listing_table(made.markers)
    detail = tuple(range(SHORT, len(table.columns)))
    shown = type(table)(table.columns, table.rows, table.right, brief=BRIEF, detail=detail)
    note = "sd: over the maps; apart: the largest distance between two maps, aligned on all markers, and on the reference alone"
    yield Section.of("", shown, *quiet(note), title="Marker by marker", key="markers")
    yield from ends(made.remarks, written)


def _prediction(made: Any) -> Iterator[Text]:
    found = made.comparison
    if found.chi2 is not None and found.dof:
        times = float(np.sqrt(found.chi2 / found.dof))
        yield Text.of(
            f"{figure(times, 3)} times as much as the maps predict (chi2 {found.chi2:.4g}, {found.dof} degrees of freedom)"
        )


def compare_pictures(made: Any) -> Iterator[Section]:
    """Scatter against distance, along the axes, and on the map."""
    found = made.comparison
    caption = "Between every two maps, the middle of each marker. Red: maps aligned on the reference marker alone; blue: on all markers."
    yield Section.of("Distance from the reference", Figure(draw_distances(found), caption), key="distance")
    caption = "Corners, and what each map has them off the mean, along the axes of the reference marker. Grey: two sigma as predicted."
    yield Section.of("Along the axes", Figure(draw_axes(found), caption), key="axes")
    scatter = np.concatenate([found.deviation, np.zeros_like(found.deviation)], axis=1).ravel()
    mean = replace(found.maps[0], covariance=np.diag(scatter**2))
    moved = [m.test.name for m in made.moved]
    caption = "Colours and ellipses: the scatter over the maps. Red frames: markers that moved."
    yield Section.of(
        "The map", Figure(draw_map(mean, title="The mean map", marked=moved, what="scatter"), caption), key="map"
    )
