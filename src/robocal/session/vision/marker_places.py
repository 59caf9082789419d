"""Markers whose places nobody states: where they are to one another, as views that show several say, to begin a fit with.

The map grows (see `vision.map_start`); the marker that most views show stays where it is, and all others are found beside it. Where the
lens is to be found too, the map is asked once more through the lens that a fit from there finds: of a marker in one view alone, two
tilts fit nearly alike, and a lens that was stated wrong takes the wrong one.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robocal._record import replace
from robocal.errors import ModelError
from robocal.estimate.least_squares import least_squares
from robocal.fit.starts.own import place_configurations
from robocal.geometry import se3
from robocal.measure.base import problem as build
from robocal.measure.data import Frame
from robocal.measure.machine import Rig
from robocal.measure.pixels import intrinsics_of, parameters
from robocal.parameters import FRAME_SYMBOLS
from robocal.session.base_markers import whole_sights
from robocal.session.vision.corner_table import CornerTable
from robocal.vision.map_start import MapStart, MarkerSights, grow_map, revise_map
from robocal.vision.sightings import find_islands

__all__ = ["EXPECTED", "place_markers"]

Look = Callable[[MarkerSights, MapStart], None]
EXPECTED = 0.2, 1.0  # of a marker's place where views show it, m and rad
WANTED = "views that show markers of both groups, or --sheet, which says where all of them are"
SHOWN = 8  # grid: markers that a sentence names
FULL = 6  # grid: numbers of a pose
LOSS = "huber"  # a corner that a decoder guessed decides between no two starts


def place_markers(table: CornerTable, wanted: str = "", look: Look | None = None) -> CornerTable:
    """The same with a start for every view, and for the place of every marker beside the one that most views show. Raises ModelError where
    no views join them: `wanted` says what would. `look` is shown the start, and may object."""
    obs = table.pixels
    if not obs.targets:
        return table
    sights = whole_sights(table.pixels)
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
    begun = _begin(table, start, first)
    return _revise(table, begun, first) if obs.options.get("free") else begun


def _begin(table: CornerTable, start: MapStart, first: int) -> CornerTable:
    """The table with a start, in which one marker stays where it is."""
    places = se3.inverse(start.markers[first]) @ start.markers
    targets = tuple(
        Frame(f.name, tuple(se3.to_vector(places[i]).tolist()), (i != first,) * 6, "tool", EXPECTED)
        for i, f in enumerate(table.pixels.targets)
    )
    views = replace(table.data.configurations, start=se3.to_vector(start.views @ start.markers[first]))
    observations = (replace(table.pixels, targets=targets),)
    return replace(table, data=replace(table.data, observations=observations, configurations=views))


def _revise(table: CornerTable, begun: CornerTable, first: int) -> CornerTable:
    """Another start, where a lens that was stated wrong let a marker or a view begin at the wrong one of its two poses, from which no fit
    comes back: of both, the one of which a fit leaves less."""
    model, obs = Rig("map"), table.pixels
    one = build(model, place_configurations(model, begun.data)).with_loss(LOSS)
    ended = least_squares(one)
    at = [one.table.index[p.name] for p in parameters(begun.pixels)[: len(intrinsics_of(obs))]]
    frames = [[one.table.index[f"{t.name}.{s}"] for s in FRAME_SYMBOLS] for t in obs.targets]
    views, markers = one.values_of(0, ended.x)[0].reshape(-1, FULL), ended.x[0, frames]
    seen = replace(obs, options={**obs.options, "intrinsics": tuple(ended.x[0, at].tolist())})
    other = revise_map(
        whole_sights(seen), np.array(intrinsics_of(seen)), se3.from_vector(views), se3.from_vector(markers)
    )
    if other is None:
        return begun
    again = _begin(table, other, first)
    two = build(model, place_configurations(model, again.data)).with_loss(LOSS)
    return again if least_squares(two).cost[0] < ended.cost[0] else begun


def _names(names: list[str]) -> str:
    some = sorted(names, key=lambda n: (len(n), n))
    return ", ".join(some[:SHOWN]) + (f" and {len(some) - SHOWN} more" if len(some) > SHOWN else "")
