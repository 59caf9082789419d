"""Markers whose places nobody states: where they are to one another, as views that show several say, to begin a fit with.

The map grows (see `vision.map_start`); the marker that most views show stays where it is, and all others are found beside it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robocal._record import replace
from robocal.errors import ModelError
from robocal.fit.starts.cameras import resect_sights
from robocal.geometry import se3
from robocal.measure.data import Frame
from robocal.measure.pixels import rays
from robocal.session.vision.corner_table import CornerTable
from robocal.vision.map_start import MapStart, MarkerSights, grow_map
from robocal.vision.sightings import find_islands

__all__ = ["EXPECTED", "place_markers", "whole_sights"]

Look = Callable[[MarkerSights, MapStart], None]
EXPECTED = 0.2, 1.0  # of a marker's place where views show it, m and rad
WHOLE = 4  # grid: corners of a marker that is seen whole
WANTED = "views that show markers of both groups, or --sheet, which says where all of them are"
SHOWN = 8  # grid: markers that a sentence names


def place_markers(table: CornerTable, wanted: str = "", look: Look | None = None) -> CornerTable:
    """The same with a start for every view, and for the place of every marker beside the one that most views show. Raises ModelError where
    no views join them: `wanted` says what would. `look` is shown the start, and may object."""
    obs = table.pixels
    if not obs.targets:
        return table
    sights = whole_sights(table)
    seen = np.zeros((len(table.data.configurations), len(obs.targets)), dtype=bool)
    seen[sights.view, sights.marker] = True
    islands = find_islands(seen)
    if len(islands) > 1:
        apart = "; ".join(_names([obs.targets[i].name for i in island.tolist()]) for island in islands[:SHOWN])
        raise ModelError(
            "no view joins some markers to the others", key="marker", found=apart, expected=wanted or WANTED
        )
    start = grow_map(sights, np.array(obs.options["intrinsics"]), *seen.shape)
    if look is not None:
        look(sights, start)
    first = int(seen.sum(axis=0).argmax())
    places = se3.inverse(start.markers[first]) @ start.markers
    targets = tuple(
        Frame(f.name, tuple(se3.to_vector(places[i]).tolist()), (i != first,) * 6, "tool", EXPECTED)
        for i, f in enumerate(obs.targets)
    )
    views = replace(table.data.configurations, start=se3.to_vector(start.views @ start.markers[first]))
    return replace(table, data=replace(table.data, observations=(replace(obs, targets=targets),), configurations=views))


def _names(names: list[str]) -> str:
    some = sorted(names, key=lambda n: (len(n), n))
    return ", ".join(some[:SHOWN]) + (f" and {len(some) - SHOWN} more" if len(some) > SHOWN else "")


def whole_sights(table: CornerTable) -> MarkerSights:
    """Each marker in each view that shows it whole, with both poses that its four corners allow."""
    obs = table.pixels
    assert obs.target is not None
    order = np.lexsort((obs.target, obs.configuration))
    key = obs.configuration[order] * len(obs.targets) + obs.target[order]
    kinds, first, many = np.unique(key, return_index=True, return_counts=True)
    whole = many == WHOLE
    rows = order[first[whole, None] + np.arange(WHOLE)]
    along = rays(obs, obs.value)
    found = resect_sights(
        obs.extra["point"][rows].reshape(-1, 3), along[rows].reshape(-1, 3), WHOLE * np.arange(len(rows)), 2
    )
    poses = np.stack([np.stack([some[0], some[-1]]) for some in found])
    view, marker = np.divmod(kinds[whole], len(obs.targets))
    return MarkerSights(view, marker, obs.value[rows], obs.extra["point"][rows], poses)
