"""A map that was known before as what is believed of its markers: surveyed tags, boards, last month's map.

A map is known but for where it is as a whole, so its covariance gets the motion of the whole:

    C + G S G^T,   G the rigid motions, S = diag(whole^2)

wide where the map is only a prior of what its markers are to one another, narrow where photographs are placed in it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record, replace
from robocal._types import Array
from robocal.diagnose.limits import MARKER_MOVED_CHANCE
from robocal.errors import ModelError
from robocal.geometry import se3
from robocal.geometry.fits import rigid
from robocal.measure.data import Frame
from robocal.parameters import FRAME_SYMBOLS, Together
from robocal.vision.map_gauge import move_map, rigid_motions
from robocal.vision.maps import MarkerMap

__all__ = ["FIXED", "LOOSE", "MapPrior", "MarkerChange", "find_moved", "prior_targets", "take_markers"]

LOOSE = 1.0, 0.1  # tolerance: m and rad of a whole map: far more than a start is off by
FIXED = 1e-6, 1e-6  # tolerance: m and rad of a whole map: far less than any map is known to
FINEST = 3e-6  # tolerance: m and rad of a single marker: a prior that is exact in some direction has no inverse


@record(eq=False)
class MapPrior:
    """Targets at the places that a prior gives them, with standard deviations, and the priors that they share; other targets stay as they
    were."""

    targets: tuple[Frame, ...]
    together: tuple[Together, ...]


@record
class MarkerChange:
    """A marker that contradicts what was known of it: by how far it moved (m), by how much it turned (rad), and the chance of as much."""

    name: str
    distance: float
    turn: float
    chance: float


def take_markers(known: MarkerMap, names: Sequence[str]) -> MarkerMap:
    """The markers of these names, in this order."""
    at = [known.names.index(n) for n in names]
    rows = (6 * np.array(at)[:, None] + np.arange(6)).ravel()
    covariance = None if known.covariance is None else known.covariance[np.ix_(rows, rows)]
    return replace(known, names=tuple(names), size=known.size[at], vector=known.vector[at], covariance=covariance)


def prior_targets(
    maps: Sequence[MarkerMap], targets: Sequence[Frame], whole: tuple[float, float] = LOOSE, *, align: bool = True
) -> MapPrior:
    """What maps say of targets of the same names. A map is moved to where its markers start, unless `align` is false; of one marker alone
    nothing is known. Raises ModelError for a map without covariance, and a marker that two maps have."""
    by_name = {t.name: t for t in targets}
    out: list[Together] = []
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
        covariance = widen(known, whole)
        sigma = np.sqrt(np.diag(covariance)).reshape(-1, 6)
        for name, vector, own in zip(names, known.vector.tolist(), sigma.tolist(), strict=True):
            by_name[name] = replace(by_name[name], value=tuple(vector), free=(True,) * 6, prior=tuple(own))
        rows = tuple(f"{n}.{s}" for n in names for s in FRAME_SYMBOLS)
        out.append(Together(rows, tuple(map(tuple, covariance.tolist()))))
    return MapPrior(tuple(by_name[t.name] for t in targets), tuple(out))


def widen(known: MarkerMap, whole: tuple[float, float]) -> Array:
    """The covariance (6M, 6M) of a map whose place as a whole may be off by so much (m, rad), about its middle."""
    assert known.covariance is not None
    g = rigid_motions(known.vector[:, :3] - known.vector[:, :3].mean(axis=0)) * np.repeat(whole, 3)
    finest = min(FINEST, *whole) ** 2 * np.eye(len(g))
    return np.asarray(known.covariance + g @ g.T + finest)


def find_moved(prior: MapPrior, found: MarkerMap) -> tuple[MarkerChange, ...]:
    """Markers that a fit with a prior took from where the prior had them, by more than chance; the largest contradiction first.

    With a prior of covariance C and a result of covariance D, both with the motion of the whole, the result moves by e with covariance
    C - D: e^T (C - D)^-1 e has a chi2 distribution. The motion of the whole is taken off e. What one marker moved pulls at others, so
    the worst is named, taken out, and the others are asked again. Source: Kalman's innovation, Bar-Shalom (2001).
    """
    assert found.covariance is not None
    out: list[MarkerChange] = []
    at = {t.name: np.array(t.value) for t in prior.targets}
    for shared in prior.together:
        names = [n for n in dict.fromkeys(r.rpartition(".")[0] for r in shared.names) if n in found.names]
        while len(names) > 2:
            before = np.array([at[n] for n in names])
            now = take_markers(found, names)
            assert now.covariance is not None
            t = rigid(now.corners.reshape(-1, 3), replace(now, vector=before).corners.reshape(-1, 3))
            there = se3.displacement(se3.from_vector(before), t @ now.poses)
            c = shared.of([f"{n}.{s}" for n in names for s in FRAME_SYMBOLS])
            changes = []
            for i, name in enumerate(names):
                own = slice(6 * i, 6 * i + 6)
                e = np.concatenate([there[0][i], there[1][i]])
                difference = c[own, own] - now.covariance[own, own]
                changes.append(_change(name, e, difference, c[own, own]))
            worst = min(changes, key=lambda m: (m.chance, -m.distance))
            if worst.chance * len(names) > MARKER_MOVED_CHANCE:
                break
            out.append(worst)
            names.remove(worst.name)
    return tuple(out)


def _change(name: str, e: Array, difference: Array, prior: Array) -> MarkerChange:
    """The chance of a change e (6,); directions that the result knows no better than the prior did say nothing."""
    scale = np.sqrt(np.diag(prior))
    values, along = np.linalg.eigh(difference / np.outer(scale, scale))
    some = values > 1e-6  # tolerance: of the prior's variance
    z = along.T @ (e / scale)
    chi2 = float(np.sum(z[some] ** 2 / values[some]))
    chance = float(scipy.special.chdtrc(int(some.sum()), chi2)) if some.any() else 1.0
    return MarkerChange(name, float(np.linalg.norm(e[:3])), float(np.linalg.norm(e[3:])), chance)
