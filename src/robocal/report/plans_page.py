"""The page of maps of markers that were predicted: plan by plan, then the first one marker by marker and in space."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from robocal.report.map_scene import draw_map
from robocal.report.sections import Detail, Figure, Section, Text, ends, figure, listing_table, quiet

__all__ = ["plans_pictures", "plans_sections"]

BRIEF = 12  # plans that a terminal lists
SHORT = 8  # columns for which it has room


def plans_sections(made: Any, written: Sequence[Path]) -> Iterator[Section]:
    """The errors of the best plan, and of every plan."""
    errors = [p.predicted.errors for p in made.plans]
    best = min(range(len(errors)), key=lambda i: max(errors[i].camera_xy, errors[i].camera_z))
    one = errors[best]
    words = f"{figure(1e3 * one.camera_xy, 3)} mm in x and y, {figure(1e3 * one.camera_z, 3)} mm in z"
    several = f", the best of {len(errors)} plans" if len(errors) > 1 else ""
    yield Section.of(
        "",
        Text.of((words, "strong"), f"   expected error of the camera's place, rms of an axis{several}"),
        *quiet(
            f"{len(made.cameras)} poses, corners to {made.sigma:g} px, {len(made.plans[0].predicted.views)} markers"
        ),
    )
    table = listing_table(made.listing)
    detail = tuple(range(SHORT, len(table.columns)))
    shown = type(table)(table.columns, table.rows, table.right, brief=BRIEF, detail=detail)
    reference = made.plans[0].predicted.reference
    note = (
        "rms of an axis. map: the markers, laid on the truth as well as it goes; worst z: the largest sigma; camera: of a new image in "
        f"the finished map; reference: markers in the frame of marker {reference}, as that was found"
    )
    yield Section.of("", shown, Detail(lambda: quiet(note)), title="Plan by plan", key="plans")
    yield from ends(made.remarks, written)


def plans_pictures(made: Any) -> Iterator[Section]:
    """The first plan marker by marker, and in space."""
    found = made.plans[0].predicted
    yield Section.of("Marker by marker", listing_table(made.markers), key="markers", folded=True)
    caption = "Markers of the first plan with the cameras; colours and ellipses: what each marker will be off by."
    yield Section.of("The plan", Figure(draw_map(found.map, made.cameras, title="The plan"), caption), key="map")
