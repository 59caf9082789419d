"""A map that was known before as what is believed of its markers: surveyed tags, boards, last month's map.

A map is known but for where it is as a whole, so its covariance gets the motion of the whole:

    C + G S G^T,   G the rigid motions, S = diag(whole^2)

wide where the map is only a prior of what its markers are to one another, narrow where photographs are placed in it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record, replace
from robocal._types import Array
from robocal.diagnose.vision_limits import MARKER_MOVED_CHANCE
from robocal.errors import ModelError
from robocal.geometry import se3
from robocal.geometry.fits import rigid
from robocal.measure.data import Frame
from robocal.measure.pixels import EDGE
from robocal.parameters import FRAME_SYMBOLS, Together
from robocal.vision.map_gauge import move_map, rigid_motions, take_markers
from robocal.vision.maps import MarkerMap

__all__ = [
    "FIXED",
    "LOOSE",
    "NEAR",
    "MapPrior",
    "MarkerChange",
    "SizedPrior",
    "chance_of",
    "find_contradictions",
    "prior_targets",
]

LOOSE = (
    0.3,
    0.05,
)  # tolerance: m and rad of a whole map: far more than a start is off by, and little enough to be believed
NEAR = (
    1e-3,
    1e-4,
)  # tolerance: m and rad of the one map that says where all is: a turn of 0.05 rad would pass for a scale, 1 - cos
FIXED = 1e-6, 1e-6  # tolerance: m and rad of a whole map: far less than any map is known to
FINEST_EDGE = 1e-6  # tolerance: m: the same of an edge
FINEST = 3e-6  # tolerance: m and rad of a single marker: a prior that is exact in some direction has no inverse


@record(eq=False)
class MapPrior:
    """Targets at the places that a prior gives them, with standard deviations, and the priors that they share; other targets stay as they
    were. `sized` are the same priors where the map found sizes, with these."""

    targets: tuple[Frame, ...]
    together: tuple[Together, ...]
    sized: tuple[SizedPrior, ...] = ()


@record
class SizedPrior:
    """A prior of markers and of their edges, and the edges (m) that it has, by the names of their parameters."""

    shared: Together
    edges: Mapping[str, float]


@record
class MarkerChange:
    """A marker that contradicts what was known of it: how far from its place it stands (m), by how much it is turned (rad), the chance of
    as much where it did not move, and chi2 with its degrees of freedom."""

    name: str
    distance: float
    turn: float
    chance: float
    chi2: float
    dof: int


def prior_targets(
    maps: Sequence[MarkerMap],
    targets: Sequence[Frame],
    whole: tuple[float, float] = LOOSE,
    *,
    align: bool = True,
    first: tuple[float, float] | None = None,
) -> MapPrior:
    """What maps say of targets of the same names; how well the `first` of them is placed as a whole may be said. A map is moved to where
    its markers start, unless `align` is false; of one marker alone nothing is known. Raises ModelError for a map without covariance, and
    a marker that two maps have."""
    by_name = {t.name: t for t in targets}
    out: list[Together] = []
    sized: list[SizedPrior] = []
    done: dict[str, MarkerMap] = {}
    for given in maps:
        names = [n for n in given.names if n in by_name]
        for name in names:
            if name in done:
                raise ModelError("two maps have one marker", key=name, found=done[name].source, expected="one of them")
            done[name] = given
        if align and len(names) < 2:
            continue
        if given.covariance is None:
            expected = "sigma of its markers: without it nobody knows what it is worth"
            raise ModelError("a prior without sigma", key="--prior", found=given.source, expected=expected)
        known = take_markers(given, names)
        if align:
            there = replace(known, vector=np.array([by_name[n].value for n in names]))
            known = move_map(known, rigid(known.corners.reshape(-1, 3), there.corners.reshape(-1, 3)))
        covariance = widen(known, first if first is not None and not out else whole)
        sigma = np.sqrt(np.diag(covariance)).reshape(-1, 6)
        for name, vector, own in zip(names, known.vector.tolist(), sigma.tolist(), strict=True):
            by_name[name] = replace(by_name[name], value=tuple(vector), free=(True,) * 6, prior=tuple(own))
        rows = tuple(f"{n}.{s}" for n in names for s in FRAME_SYMBOLS)
        out.append(Together(rows, tuple(map(tuple, covariance.tolist()))))
        if known.size_covariance is not None:
            own, count = [f"{n}.{EDGE}" for n in names], len(covariance)
            across, edges = known.size_covariance[:, :count], known.size_covariance[:, count:]
            joint = np.block([[covariance, across.T], [across, edges + FINEST_EDGE**2 * np.eye(len(own))]])
            shared = Together((*rows, *own), tuple(map(tuple, joint.tolist())))
            sized.append(SizedPrior(shared, dict(zip(own, known.size.tolist(), strict=True))))
    return MapPrior(tuple(by_name[t.name] for t in targets), tuple(out), tuple(sized))


def widen(known: MarkerMap, whole: tuple[float, float]) -> Array:
    """The covariance (6M, 6M) of a map whose place as a whole may be off by so much (m, rad), about its middle."""
    assert known.covariance is not None
    g = rigid_motions(known.vector[:, :3] - known.vector[:, :3].mean(axis=0)) * np.repeat(whole, 3)
    finest = min(FINEST, *whole) ** 2 * np.eye(len(g))
    return np.asarray(known.covariance + g @ g.T + finest)


def find_contradictions(prior: MapPrior, found: MarkerMap) -> tuple[MarkerChange, ...]:
    """Markers that contradict what a prior said of them, by more than chance; the worst first. `found` is the map of a fit with the prior.

    With P = C^-1 of the prior, the result moved by e, with covariance D: w = P e has covariance S = P - P D P. For each marker

    shift = S_k^-1 w_k,   w_k^T S_k^-1 w_k ~ chi2(6)

    is how far from its place the marker alone would have to stand, the others where the prior has them to one another.
    Source: Baarda, A testing procedure for use in geodetic networks (1968).
    """
    assert found.covariance is not None
    out: list[MarkerChange] = []
    at = {t.name: se3.from_vector(np.array(t.value)) for t in prior.targets}
    for shared in prior.together:
        names = [n for n in dict.fromkeys(r.rpartition(".")[0] for r in shared.names) if n in found.names]
        now = take_markers(found, names)
        assert now.covariance is not None
        steps, turns = se3.displacement(np.stack([at[n] for n in names]), now.poses)
        information = np.asarray(
            np.linalg.inv(shared.of([f"{n}.{s}" for n in names for s in FRAME_SYMBOLS])), dtype=float
        )
        w = information @ np.concatenate([steps, turns], axis=1).ravel()
        spread = information - information @ now.covariance @ information
        for i, name in enumerate(names):
            own = slice(6 * i, 6 * i + 6)
            out.append(_change(name, w[own], spread[own, own], np.diag(information[own, own])))
    worst = (replace(m, chance=chance_of(m, 1.0)) for m in out)
    some = [m for m in worst if m.chance * len(out) <= MARKER_MOVED_CHANCE]
    return tuple(sorted(some, key=lambda m: -m.chi2))


def chance_of(change: MarkerChange, noise: float) -> float:
    """The chance of a contradiction where variances are `noise` times those that were stated."""
    return float(scipy.special.chdtrc(change.dof, change.chi2 / max(noise, 1.0))) if change.dof else 1.0


def _change(name: str, w: Array, spread: Array, known: Array) -> MarkerChange:
    """The shift of a marker; directions in which the data add nothing to the information (6,) of the prior say nothing."""
    scale = np.sqrt(known)
    values, along = np.linalg.eigh(spread / np.outer(scale, scale))
    some = values > 1e-6  # tolerance: of what the prior knows
    z = along.T[some] @ (w / scale)
    chi2 = float(np.sum(z**2 / values[some]))
    shift = along[:, some] @ (z / values[some]) / scale
    return MarkerChange(
        name, float(np.linalg.norm(shift[:3])), float(np.linalg.norm(shift[3:])), 1.0, chi2, int(some.sum())
    )
