"""The page of a map of markers: verdict, errors, markers, views, the lens, and the map in space."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from robocal.remarks.remark import sentences
from robocal.report.map_scene import draw_map
from robocal.report.sections import Figure, Section, Text, VerdictBlock, ends, figure, listing_table, quiet

__all__ = ["map_pictures", "map_sections"]

VERDICTS: dict[str, tuple[str, Any, str]] = {
    "located": ("located", "good", "Views that were left out are met as well as the noise of corners allows."),
    "not_improved": ("not located", "doubtful", "The map is not proven: look at what is said below before it is used."),
    "refused": ("refused", "bad", "Do not use this map; it is listed for diagnosis only."),
}
BRIEF = 12  # rows that a terminal lists
SHOWN = ("marker", "views", "x", "y", "z", "sigma", "turn_sigma", "rms", "left_out", "aside")  # map.yaml has the turns


def map_sections(found: Any, written: Sequence[Path]) -> Iterator[Section]:
    """The verdict, the errors, the markers, the views and the lens."""
    said, errors = found.verdict, found.errors
    word, style, meaning = VERDICTS[said.status]
    advice = () if said.status == "located" else tuple(dict.fromkeys(r.advice for r in said.remarks if r.advice))
    yield Section.of("", VerdictBlock(word, style, tuple(sentences(said.remarks)), advice, meaning, ""))
    count, views = len(found.off.left), len(found.table.data.configurations)
    aside = int((~found.off.used).sum())
    lines = [
        Text.of(
            (f"{figure(errors.median, 2)} px", "strong"),
            f"   median, {figure(errors.every, 2)} px rms of all {count} corners in {views} views",
        )
    ]
    if aside:
        lines.append(
            Text.of((f"{figure(errors.fitted.rms, 2)} px", "strong"), f"   rms without the {aside} that were set aside")
        )
    if errors.left_out is not None:
        lines.append(
            Text.of(
                (f"{figure(errors.left_out.rms, 2)} px", "strong"),
                "   rms of views that were left out, their own poses fitted",
            )
        )
    sigma = 1e3 * found.sigma[:, 0]
    lines.append(
        Text.of(
            (f"{figure(float(np.median(sigma)), 2)} mm", "strong"),
            f"   sigma of a marker's place (median), {figure(float(sigma.max()), 2)} mm of the least sure, {_marker(found)}",
        )
    )
    prior = (
        () if found.stated else ("the lens states no sigma: f and c are taken to be known to 10 px, distortion to 0.1",)
    )
    yield Section.of(
        "",
        *lines,
        *quiet(
            f"origin: marker {found.origin}, a choice of coordinates; sigma counts no motion of the whole map",
            "all lengths together are as true as the edges of the markers, or distances in --prior; sigma holds it",
            *prior,
        ),
    )
    shown = [c for c in found.markers.columns if c.name in SHOWN]
    yield Section.of(
        "", _brief(type(found.markers)(tuple(shown))), title="Marker by marker, the least sure first", key="markers"
    )
    yield Section.of("", _brief(found.views), title="View by view", key="views")
    yield Section.of("", listing_table(found.lens), title="The lens", key="lens")
    yield from ends(found.warnings, written)


def _marker(found: Any) -> str:
    return f"marker {found.map.names[int(found.sigma[:, 0].argmax())]}"


def _brief(listing: Any) -> Any:
    table = listing_table(listing)
    return type(table)(table.columns, table.rows, table.right, brief=BRIEF)


def map_pictures(found: Any) -> Iterator[Section]:
    """The map in space, with the cameras."""
    moved = [found.map.names[m.marker] for m in found.moved]
    caption = "Markers with their numbers and ellipses of sigma, and where the camera was. Turn it with the mouse."
    yield Section.of("The map", Figure(draw_map(found.map, found.fit.cameras, marked=moved), caption), key="map")
