"""The page of images in a map: where the camera was, how surely, and the map with the cameras in it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from robocal.report.map_scene import draw_map
from robocal.report.sections import Figure, Section, Text, ends, figure, listing_table, quiet

__all__ = ["places_pictures", "places_sections"]

BRIEF = 12  # images that a terminal lists
SHORT = 7  # columns for which it has room: the turn is among them


def places_sections(found: Any, written: Sequence[Path]) -> Iterator[Section]:
    """How well the corners are met, the poses, and images that have two."""
    views = found.views
    aside = int(views.aside.sum())
    said = f", {aside} excluded" if aside else ""
    yield Section.of(
        "",
        Text.of(
            (f"{figure(views.left, 3)} px", "strong"), f"   rms of one axis, {int(views.corners.sum())} corners{said}"
        ),
        *quiet(found.note),
    )
    for key, title, listing, note in (
        ("views", "Image by image", found.quality, "sigma: of the place, in all directions together"),
        (
            "poses",
            "The poses",
            found.listing,
            "the camera in the frame of the map; sigma of small turns is about its axes",
        ),
    ):
        table = listing_table(listing)
        shown = type(table)(
            table.columns, table.rows, table.right, brief=BRIEF, detail=tuple(range(SHORT, len(table.columns)))
        )
        yield Section.of("", shown, *quiet(note), title=title, key=key)
    if views.rivals:
        yield Section.of(
            "",
            listing_table(found.rivals),
            *quiet("neither is in the list: the corners do not decide which one it is"),
            title="Images with two poses",
            key="rivals",
        )
    yield from ends(found.remarks, written)


def places_pictures(found: Any) -> Iterator[Section]:
    """The map with the cameras in it."""
    moved = [m.name for m in found.views.moved]
    caption = (
        "Markers with their numbers, and the cameras where the images were taken. Red: markers that stand elsewhere."
    )
    svg = draw_map(found.known, found.views.poses, title="Images in the map", marked=moved)
    yield Section.of("The map", Figure(svg, caption), key="map")
