"""Markers that stand elsewhere than a prior has them, in corners: found one by one, so that one does not accuse its neighbours."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record, replace
from robocal._types import Array
from robocal.diagnose.limits import CELL_UNIT_NEAR
from robocal.diagnose.vision_limits import MARKER_MOVED_CHANCE, MARKER_SIZE_CHANCE, POSE_RIVAL
from robocal.errors import ModelError
from robocal.estimate.least_squares import least_squares
from robocal.estimate.problem import Problem
from robocal.estimate.uncertainty import uncertainty
from robocal.geometry import se3
from robocal.geometry.fits import rigid
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet
from robocal.measure.machine import Rig
from robocal.parameters import FRAME_SYMBOLS
from robocal.session.vision.corner_table import CAMERA, CornerTable
from robocal.session.vision.map_prior import NEAR, MapPrior, MarkerChange, chance_of, find_contradictions, prior_targets
from robocal.session.vision.map_sizes import EdgeErrors, with_edges
from robocal.vision.map_gauge import take_markers
from robocal.vision.maps import MarkerMap

__all__ = [
    "DisplacedMarker",
    "exclude_markers",
    "find_displaced",
    "measure_displaced",
    "most_displaced",
    "with_map_prior",
]

LEAST = 3  # grid: markers that have a place to one another
FEW, SHARE = 3, 8  # grid: markers that are looked for, or one in so many: of more it is the prior that is wrong
FINEST = 1e-9  # tolerance: m: markers that lie in one place
UNITS = {  # by how much a length is too large that is read in one unit, and meant in another
    1000.0: ("m", "mm"), 1e-3: ("mm", "m"), 100.0: ("m", "cm"), 10.0: ("cm", "mm"), 0.1: ("mm", "cm"),
    1 / 25.4: ("mm", "inch"), 25.4: ("inch", "mm"), 1 / 0.0254: ("m", "inch"), 0.0254: ("inch", "m"), 2.54: ("inch", "cm"),
    1 / 2.54: ("cm", "inch"), 1 / 0.3048: ("m", "ft"), 0.3048: ("ft", "m"), 304.8: ("ft", "mm"), 1 / 304.8: ("mm", "ft"),
    12.0: ("ft", "inch"), 1 / 12: ("inch", "ft"),
}  # fmt: skip
SAME_SIZE = 0.02  # tolerance: of the edge: printers scale by less


@record
class DisplacedMarker:
    """A marker that contradicts its prior, and another that explains as much where there is one."""

    change: MarkerChange
    other: str


def find_displaced(data: DataSet, prior: MapPrior, loss: str) -> tuple[DisplacedMarker, ...]:
    """Under the stated noise, for a large contradiction passes for noise otherwise; each has to contradict by more than the noise that is
    left without it. `data` have the targets of the prior, and what these share. One more than `most_displaced` is looked for: where it
    is found, no single markers are wrong."""
    out: list[DisplacedMarker] = []
    names = [t.name for t in prior.targets if t.prior is not None]
    gone: list[str] = []
    while prior.together and len(gone) <= most_displaced(prior):
        made = build(Rig(CAMERA), exclude_markers(data, gone)).with_loss(loss)
        x = least_squares(made, made.start).x
        rest = [m for m in find_contradictions(prior, _map_of(made, x, names)) if m.name not in gone]
        if not rest:
            break
        less = build(Rig(CAMERA), exclude_markers(data, [*gone, rest[0].name])).with_loss(loss)
        left = uncertainty(less, least_squares(less, x).x)
        if chance_of(rest[0], left.chi2 / max(left.dof, 1)) * len(names) > MARKER_MOVED_CHANCE:
            break
        alike = [m.name for m in rest[1:] if m.chi2 > rest[0].chi2 + 2 * np.log(POSE_RIVAL)]
        out.append(DisplacedMarker(rest[0], alike[0] if alike else ""))
        gone.append(rest[0].name)
    return tuple(out)


def most_displaced(prior: MapPrior) -> int:
    """How many markers may contradict a prior that is right of the others."""
    return max(FEW, sum(t.prior is not None for t in prior.targets) // SHARE)


def _map_of(problem: Problem, x: Array, names: Sequence[str]) -> MarkerMap:
    """The markers as a fit has them, with their covariance."""
    own = [f"{n}.{s}" for n in names for s in FRAME_SYMBOLS]
    vector = x[0, [problem.table.index[n] for n in own]].reshape(-1, 6)
    rows = [problem.free.index(n) for n in own]
    covariance = uncertainty(problem, x).covariance[np.ix_(rows, rows)]
    return MarkerMap(tuple(names), np.ones(len(names)), se3.to_vector(se3.from_vector(vector)), covariance)


def exclude_markers(data: DataSet, names: Sequence[str]) -> DataSet:
    """The data with the corners of some markers set aside."""
    (obs,) = data.observations
    assert obs.target is not None
    gone = np.isin(obs.target, [i for i, t in enumerate(obs.targets) if t.name in names])
    return replace(data, observations=(replace(obs, used=~gone if obs.used is None else obs.used & ~gone),))


def with_map_prior(
    table: CornerTable, maps: Sequence[MarkerMap], loss: str, edges: EdgeErrors | None = None
) -> tuple[CornerTable, tuple[DisplacedMarker, ...]]:
    """Corners whose markers have a start, with what maps say of these beforehand; and markers that contradict it, of which nothing is
    taken; edges are free within what is known of them. Raises ModelError."""
    _refuse_units(table, maps)
    _refuse_others(table, maps, edges)
    far = _far(table, maps)
    near = _without(maps, {m.change.name for m in far})
    data, prior = _believe(table.data, near)
    displaced = far + find_displaced(with_edges(replace(table, data=data), edges, prior).data, prior, loss)
    if len(displaced) > most_displaced(prior):
        raise ModelError(
            "more than single markers contradict the prior", key="--prior",
            found=f"{', '.join(m.change.name for m in displaced)} stand elsewhere, and perhaps others",
            expected="a map of these markers as they stand now; leave those that moved out of the file",
        )  # fmt: skip
    if displaced:
        data, prior = _believe(table.data, _without(maps, {m.change.name for m in displaced}))
    return with_edges(replace(table, data=data), edges, prior), displaced


def _without(maps: Sequence[MarkerMap], gone: Collection[str]) -> list[MarkerMap]:
    """What maps say of the other markers."""
    rest = [[n for n in m.names if n not in gone] for m in maps]
    return [take_markers(m, names) for m, names in zip(maps, rest, strict=True) if names]


def _far(table: CornerTable, maps: Sequence[MarkerMap]) -> tuple[DisplacedMarker, ...]:
    """Markers that a map has farther off than all that is seen of it is wide, the others laid on where they are seen: slips, beside which
    no fit of the map begins. The farthest is taken out until none is."""
    seen = {t.name: se3.from_vector(np.array(t.value)) for t in table.pixels.targets}
    out = []
    for m in maps:
        names = [n for n in m.names if n in seen]
        while len(names) > LEAST:
            told = take_markers(replace(m, covariance=None, size_covariance=None), names)
            there = np.stack([seen[n] for n in names])
            move = rigid(told.vector[:, :3], there[:, :3, 3])
            middle = np.median(there[:, :3, 3], axis=0)
            wide = 2 * float(np.linalg.norm(there[:, :3, 3] - middle, axis=1).max())
            steps, turns = se3.displacement(move @ told.poses, there)
            apart = np.linalg.norm(steps, axis=1)
            worst = int(apart.argmax())
            if apart[worst] <= wide:
                break
            away, turn = float(apart[worst]), float(np.linalg.norm(turns[worst]))
            out.append(DisplacedMarker(MarkerChange(names.pop(worst), away, turn, 0.0, float("inf"), 6), ""))
    return tuple(out)


def measure_displaced(
    displaced: Sequence[DisplacedMarker], maps: Sequence[MarkerMap], found: MarkerMap
) -> tuple[DisplacedMarker, ...]:
    """The same with how far each stands from where its map has it, the others of that map laid over `found`: a step of a fit that is as
    long as a room says it of small ones only."""
    gone, out = {m.change.name for m in displaced}, []
    for m in displaced:
        (known,) = (k for k in maps if m.change.name in k.names)
        rest = [n for n in known.names if n in found.names and n not in gone]
        if not rest:
            out.append(m)
            continue
        a, b = (take_markers(replace(k, covariance=None), [*rest, m.change.name]) for k in (known, found))
        there = rigid(a.corners[:-1].reshape(-1, 3), b.corners[:-1].reshape(-1, 3)) @ a.poses[-1]
        step, turn = se3.displacement(there, b.poses[-1])
        change = replace(m.change, distance=float(np.linalg.norm(step)), turn=float(np.linalg.norm(turn)))
        out.append(replace(m, change=change))
    return tuple(out)


def _refuse_others(table: CornerTable, maps: Sequence[MarkerMap], edges: EdgeErrors | None) -> None:
    """Raises ModelError for markers of another size or dictionary than those that are seen, or whose sizes were found elsewhere than
    they are told."""
    obs = table.pixels
    assert obs.target is not None
    seen = {t.name: 2 * float(np.abs(obs.extra["point"][obs.target == i, 0]).max()) for i, t in enumerate(obs.targets)}
    for m in maps:
        if None not in (m.family, table.family) and m.family != table.family:
            raise ModelError("a prior of another dictionary", key="--prior", found=m.family, expected=table.family)
        for name, edge in zip(m.names, m.size.tolist(), strict=True):
            if name in seen and (
                abs(edge - seen[name]) > SAME_SIZE * edge or _contradicted(m, edge - seen[name], seen[name], edges)
            ):
                found, expected = (
                    f"{1e3 * seen[name]:g} mm for marker {name}",
                    f"{1e3 * edge:g} mm, as the prior has it",
                )
                raise ModelError("another size than that of the prior", key="--size", found=found, expected=expected)


def _contradicted(known: MarkerMap, off: float, told: float, edges: EdgeErrors | None) -> bool:
    """Whether a size that a map found is too far from the one that is told now, for both to be of one print."""
    if edges is None or known.size_covariance is None:
        return False
    chi2 = off**2 / float(edges.covariance(np.array([told]))[0, 0])
    return float(scipy.special.chdtrc(1, chi2)) * len(known.names) < MARKER_SIZE_CHANCE


def _refuse_units(table: CornerTable, maps: Sequence[MarkerMap]) -> None:
    """Raises ModelError for a map whose markers are as far apart as they are seen, but for the factor of a unit."""
    at = {t.name: np.array(t.value[:3]) for t in table.pixels.targets}
    for m in maps:
        some = [i for i, n in enumerate(m.names) if n in at]
        if len(some) < 2:
            continue
        seen, told = np.array([at[m.names[i]] for i in some]), m.vector[some, :3]
        # By the median of pairs: one marker with a slip of its comma is no unit.
        pairs = np.triu_indices(len(some), 1)
        apart = [np.maximum(np.linalg.norm(v[pairs[0]] - v[pairs[1]], axis=1), FINEST) for v in (told, seen)]
        ratio = float(np.median(apart[0] / apart[1]))
        for factor, (wrong, right) in UNITS.items():
            if abs(np.log(ratio / factor)) < CELL_UNIT_NEAR:
                raise ModelError(
                    "a prior in another unit", key="--prior",
                    found=f"{m.source}: its markers are {ratio:.3g} times as far apart as they are seen",
                    expected=f"units: {{length: {right}}} in place of {wrong}, or --size in mm",
                )  # fmt: skip


def _believe(data: DataSet, maps: Sequence[MarkerMap]) -> tuple[DataSet, MapPrior]:
    (obs,) = data.observations
    prior = prior_targets(maps, obs.targets, first=NEAR)
    options = {**obs.options, "together": prior.together}
    return replace(data, observations=(replace(obs, targets=prior.targets, options=options),)), prior
