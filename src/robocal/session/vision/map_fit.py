"""A map of markers from corners: a camera whose pose is its own in every view, markers as targets whose places are to be found.

The lens is free within what is known of it beforehand, and so are the edges of the markers (`map_sizes`).
A robust loss (Huber) is the default: a marker that bends or a corner that a decoder guessed pulls no more than its neighbours.
One marker is held while the fit runs; the map is told without it (see `vision.map_gauge`): the covariance
counts no motion of all markers together.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.diagnose.limits import FOLDS, HOLD_OUT_PLACES
from robocal.diagnose.vision_limits import MARKER_SIZE, MARKER_SIZE_CHANCE
from robocal.estimate.least_squares import least_squares
from robocal.fit.options import Options
from robocal.fit.scale import without_scales
from robocal.fit.starts.own import place_configurations
from robocal.geometry import se3
from robocal.measure.machine import Rig
from robocal.measure.pixels import EDGE
from robocal.parameters import FRAME_SYMBOLS
from robocal.progress import Watch
from robocal.prove.decision import Decision, decide
from robocal.session.vision.corner_table import CAMERA, CornerTable
from robocal.session.vision.displaced import DisplacedMarker, measure_displaced, with_map_prior
from robocal.session.vision.map_moved import refuse_moved
from robocal.session.vision.map_sizes import (
    EdgeErrors,
    MarkerSizes,
    edges_of,
    find_sizes,
    prior_of,
    size_of_all,
    with_edges,
)
from robocal.session.vision.marker_places import place_markers
from robocal.vision.lenses import Lens
from robocal.vision.map_gauge import move_map, project_covariance, rigid_projector
from robocal.vision.map_start import MapStart, MarkerSights
from robocal.vision.maps import MapLens, MarkerMap

__all__ = ["MapFit", "fit_map"]

EXACT = 1e-16  # tolerance: of the cost; two programs shall agree to a millionth of the noise
JOINED = "views that show markers of both groups"


@record(eq=False)
class MapFit:
    """What was decided, the map with its covariance, where each view's camera was, T_map_camera (V, 4, 4), the lens as it was found,
    markers that contradict what was known of them before, and edges that contradict what was told."""

    decision: Decision[Rig]
    map: MarkerMap
    cameras: Array
    lens: Lens
    displaced: tuple[DisplacedMarker, ...] = ()
    sizes: MarkerSizes = MarkerSizes()


def fit_map(
    table: CornerTable,
    lens: Lens,
    loss: str,
    origin: str | None = None,
    source: str = "",
    watch: Watch | None = None,
    prior: Sequence[MarkerMap] = (),
    edges: EdgeErrors | None = None,
) -> MapFit:
    """The map that views through a lens show, whose covariance is its prior; `prior` are maps of markers that were known before, `edges`
    what their sizes may be off by. Raises ModelError."""
    model = Rig("map")
    ids, names = table.data.configurations.ids, [t.name for t in table.pixels.targets]

    def look(sights: MarkerSights, start: MapStart) -> None:
        refuse_moved(sights, start, lens.intrinsics, ids, names)

    begun = place_markers(table.with_prior(lens), JOINED, look)
    displaced: tuple[DisplacedMarker, ...] = ()
    if prior:
        begun, displaced = with_map_prior(begun, prior, loss, edges)
    else:
        begun = with_edges(begun, edges)
    # Of many views each is left out with others: one by one they would take as many fits of the whole map.
    options = Options(loss=loss)
    if len(ids) > HOLD_OUT_PLACES:
        options = replace(options, folds=FOLDS, leave_one_out=False)
    made = decide(model, place_configurations(model, begun.data), options, watch)
    fit = made.need_fit
    ended = least_squares(fit.problem, fit.solution.x, cost_tolerance=EXACT)
    made = replace(made, fit=replace(fit, solution=replace(fit.solution, x=ended.x, cost=ended.cost)))
    known = _map_of(made, begun, source, edges, lens)
    displaced = measure_displaced(displaced, prior, known)
    views = se3.inverse(se3.from_vector(made.need_fit.problem.values_of(0, ended.x)[0].reshape(-1, 6)))
    seen = np.bincount(begun.pixels.target if begun.pixels.target is not None else (), minlength=len(known.names))
    first = known.names.index(origin) if origin is not None else int(seen.argmax())
    move = se3.inverse(known.poses[first])
    sizes = _sizes_of(made, begun, edges, bool(prior))
    return MapFit(made, move_map(known, move), move @ views, _lens_of(made, lens), displaced, sizes)


def _sizes_of(made: Decision[Rig], table: CornerTable, edges: EdgeErrors | None, known: bool) -> MarkerSizes:
    """What edges look like beside one another, and beside distances where some are `known`."""
    names = [t.name for t in table.pixels.targets]
    rows = [f"{n}.{EDGE}" for n in names]
    total = without_scales(made.need_fit.total)
    if edges is None or not set(rows) <= set(total.names):
        return MarkerSizes()
    at = [total.names.index(n) for n in rows]
    off = np.array([made.values[n] for n in rows])
    facts = edges_of(table), off, total.covariance[np.ix_(at, at)], prior_of(table)
    if known:  # distances that contradict sizes are no fault of single markers
        larger, chance = size_of_all(*facts)
        if chance < MARKER_SIZE_CHANCE and abs(larger) > MARKER_SIZE:
            return MarkerSizes(larger=larger)
    return find_sizes(names, *facts, edges.scatter)


def _map_of(made: Decision[Rig], table: CornerTable, source: str, edges: EdgeErrors | None, given: Lens) -> MarkerMap:
    """The map as it was fitted, with the covariance in which no motion of all markers is counted, and that of its sizes and its lens."""
    obs = table.pixels
    names = [t.name for t in obs.targets]
    vector = np.array([[made.values[f"{n}.{s}"] for s in FRAME_SYMBOLS] for n in names])
    size = edges_of(table) + [made.values.get(f"{n}.{EDGE}", 0.0) for n in names]
    known = MarkerMap(tuple(names), size, vector, None, table.family, source)
    rows = [*(f"{n}.{s}" for n in names for s in FRAME_SYMBOLS), *(f"{n}.{EDGE}" for n in names)]
    found = _lens_of(made, given)
    rows += [f"{CAMERA}.{s}" for s in found.known]
    own = {n: i for i, n in enumerate(rows)}
    total = without_scales(made.need_fit.total)
    covariance = np.zeros((len(own), len(own)))
    told = [i for i, n in enumerate(total.names) if n in own]
    at = [own[total.names[i]] for i in told]
    covariance[np.ix_(at, at)] = total.covariance[np.ix_(told, told)]
    count, all_edges = 6 * len(names), slice(6 * len(names), 7 * len(names))
    motions, project = project_covariance(known, covariance[:count, :count]), rigid_projector(known)
    if found.known:
        beside = covariance[:, 7 * len(names) :]
        own_edges = None if edges is None else beside[all_edges]
        shared = beside[7 * len(names) :], project @ beside[:count], own_edges
        known = replace(known, lens=MapLens(found.model, found.known, given.numbers, found.numbers, *shared))
    if edges is None:
        return replace(known, covariance=motions)
    sizes = np.hstack([covariance[all_edges, :count] @ project.T, covariance[all_edges, all_edges]])
    return replace(known, covariance=motions, size_covariance=sizes, size_errors=(edges.shift, edges.scatter))


def _lens_of(made: Decision[Rig], lens: Lens) -> Lens:
    """The lens as it was found, with what its numbers may be off by."""
    numbers = [made.values[f"{CAMERA}.{s}"] for s in lens.kind.symbols]
    total = made.need_fit.total
    at = [total.names.index(f"{CAMERA}.{s}") for s in lens.known if f"{CAMERA}.{s}" in total.names]
    told = [total.names[i].rpartition(".")[2] for i in at]
    return Lens.of(lens.model, numbers, lens.size, told, total.covariance[np.ix_(at, at)], lens.source)
