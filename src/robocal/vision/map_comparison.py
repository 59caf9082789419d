"""Several maps of the same markers: how far they scatter, and whether their covariances predicted as much.

Each map is moved so that all corners of the markers that all maps have lie nearest to their means over the maps. With x_k the small
motions that lead from the mean to map k, and C_k its covariance, both without a motion of the whole map,

    x = (sum C_k^+)^-1 sum C_k^+ x_k,   chi2 = sum (x_k - x)^T C_k^+ (x_k - x),   (K - 1) (6 M - 6) degrees of freedom

and of two maps with d = x_2 - x_1 and S = C_1 + C_2 the shift that one marker alone would need, the others where they are:

    w = S^+ d,   shift_i = (S^+)_ii^-1 w_i,   w_i^T (S^+)_ii^-1 w_i ~ chi2(6)

Maps of the same prints that were told the same sizes have the error e of these in common, P = cov(e). With D_pe the covariance of places
and edges, the places of each follow e by D_pe P^-1, and between such maps C_k counts without that:

    C - D_pe P^-1 D_pe^T

Sources: Gower, Generalized Procrustes analysis (1975); Baarda (1968).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.errors import ModelError
from robocal.geometry import se3, so3
from robocal.geometry.fits import rigid
from robocal.vision.map_gauge import move_map, project_covariance, rigid_motions, rigid_projector, take_markers
from robocal.vision.maps import MarkerMap

__all__ = ["MapComparison", "ShiftTest", "compare_maps", "find_shifts"]

ROUNDS = 10  # grid: of the mean and the motions to it
FINEST = 1e-6  # tolerance: m: no edge is known better
RANK = 1e-9  # tolerance: of the largest variance: what a covariance says of directions is rounding below


@record(eq=False)
class MapComparison:
    """Maps (K) of common markers, moved to their mean; corners (K, M, 4, 3) in the frame of the reference marker, and those of the mean
    (M, 4, 3); the same with every map moved onto the reference marker alone; the distance of each marker from it (M,); by how much
    each map is larger than the mean (K,); and of maps with covariances chi2 of their scatter, its degrees of freedom, and the
    standard deviation that they predict of each middle, along the axes of the reference marker (M, 3); None where not all have one."""

    maps: tuple[MarkerMap, ...]
    reference: str
    corners: Array
    mean: Array
    anchored: Array
    distance: Array
    scale: Array
    chi2: float | None
    dof: int
    predicted: Array | None

    @property
    def names(self) -> tuple[str, ...]:
        """The markers that all maps have."""
        return self.maps[0].names

    @property
    def scatter(self) -> Array:
        """What corners differ from their mean by, (K, M, 4, 3) m, along the axes of the reference marker."""
        return np.asarray(self.corners - self.mean)

    @property
    def deviation(self) -> Array:
        """The standard deviation of each middle over the maps, (M, 3) m."""
        return np.asarray(self.corners.mean(axis=2).std(axis=0, ddof=1))

    @property
    def pair_distances(self) -> tuple[Array, Array]:
        """How far the middles of one marker are from one another in every two maps, (P, M) m: aligned on all markers, and on the
        reference marker alone."""
        i, j = np.triu_indices(len(self.maps), 1)
        middles = (c.mean(axis=2) for c in (self.corners, self.anchored))
        one, other = (np.linalg.norm(m[i] - m[j], axis=2) for m in middles)
        return one, other


@record
class ShiftTest:
    """The shift of one marker between two maps, the others where they are: m and rad, chi2 with its degrees of freedom."""

    name: str
    distance: float
    turn: float
    chi2: float
    dof: int


def compare_maps(maps: Sequence[MarkerMap], reference: str | None = None) -> MapComparison:
    """Raises ModelError for fewer than two maps, fewer than three common markers, or a reference that is none of them."""
    if len(maps) < 2:
        raise ModelError(
            "one map has nothing to be compared with", key="MAPS", found=len(maps), expected="2 maps or more"
        )
    names = [n for n in maps[0].names if all(n in m.names for m in maps[1:])]
    if len(names) < 3:
        found = ", ".join(names) or "none"
        raise ModelError("too few markers in all maps", key="MAPS", found=found, expected="3 common markers or more")
    first = reference or names[0]
    if first not in names:
        raise ModelError("no such marker in all maps", key="--reference", found=first, expected=", ".join(names[:8]))
    if all(m.size_errors is not None for m in maps):
        maps = [_without_sizes(m) for m in maps]
    some = [take_markers(m, names) for m in maps]
    mean = some[0].corners
    for _ in range(ROUNDS):
        some = [move_map(m, rigid(m.corners.reshape(-1, 3), mean.reshape(-1, 3))) for m in some]
        mean = np.mean([m.corners for m in some], axis=0)
    at = names.index(first)
    frame = _frame(mean[at])
    turned = [move_map(m, se3.inverse(frame)) for m in some]
    corners = np.stack([m.corners for m in turned])
    middle = corners.mean(axis=0)
    anchored = np.stack([move_map(m, se3.inverse(_frame(m.corners[at]))).corners for m in some])
    chi2, dof, predicted = _predict(turned)
    return MapComparison(
        tuple(turned), first, corners, middle, anchored, np.linalg.norm(middle.mean(axis=1) - middle[at].mean(axis=0), axis=1),
        _scales(corners, middle), chi2, dof, predicted,
    )  # fmt: skip


def _without_sizes(known: MarkerMap) -> MarkerMap:
    """The map with the covariance of what no other map of these prints has in common with it."""
    if known.covariance is None or known.size_covariance is None or known.size_errors is None:
        return known
    shift, scatter = known.size_errors
    told = shift**2 + np.diag((scatter * known.size) ** 2 + FINEST**2)
    across = known.size_covariance[:, : len(known.covariance)]
    own = known.covariance - across.T @ np.linalg.solve(told, across)
    return replace(known, covariance=(own + own.T) / 2, size_covariance=None, size_errors=None, lens=None)


def _frame(corners: Array) -> Array:
    """The pose of a square from its corners (4, 3), top left first."""
    x = corners[1] - corners[0] + corners[2] - corners[3]
    y = corners[0] - corners[3] + corners[1] - corners[2]
    r = so3.project(np.stack([x, y, np.cross(x, y) / np.linalg.norm(x)], axis=1))
    return se3.compose(r, corners.mean(axis=0))


def _scales(corners: Array, mean: Array) -> Array:
    """By how much each map is larger than the mean, (K,): the size of the middles about their own middle."""
    size = [float(np.linalg.norm(c - c.mean(axis=0))) for c in (*corners.mean(axis=2), mean.mean(axis=1))]
    return np.array(size[:-1]) / size[-1] - 1


def _motions(one: MarkerMap, other: MarkerMap) -> Array:
    """The small motions (6M,) that lead from one map to the other."""
    return np.concatenate(se3.displacement(one.poses, other.poses), axis=1).ravel()


def _predict(maps: Sequence[MarkerMap]) -> tuple[float | None, int, Array | None]:
    """chi2, its degrees of freedom, and the predicted standard deviation of each middle; nothing where a map has no covariance."""
    covariances = [m.covariance for m in maps]
    if any(c is None for c in covariances):
        return None, 0, None
    centre = maps[0]
    p = rigid_projector(centre)
    projected = [project_covariance(centre, c) for c in covariances if c is not None]
    x = np.stack([p @ _motions(centre, m) for m in maps])
    weights, ranks = zip(*(_inverse(c) for c in projected), strict=True)
    together, rank = _inverse(np.asarray(sum(weights)))
    mean = together @ np.einsum("kij,kj->i", np.stack(weights), x)
    left = x - mean
    chi2 = float(np.einsum("ki,kij,kj->", left, np.stack(weights), left))
    every = np.mean([np.diag(c) for c in projected], axis=0).reshape(-1, 6)[:, :3]
    return chi2, sum(ranks) - rank, np.sqrt(every)


def _inverse(covariance: Array) -> tuple[Array, int]:
    """The pseudo-inverse and the rank of a covariance of m and rad."""
    scale = np.sqrt(np.diag(covariance).clip(1e-300))
    values, along = np.linalg.eigh(covariance / np.outer(scale, scale))
    some = values > RANK * values[-1]
    root = along[:, some] / np.sqrt(values[some]) / scale[:, None]
    return np.asarray(root @ root.T), int(some.sum())


def find_shifts(one: MarkerMap, other: MarkerMap) -> tuple[ShiftTest, ...]:
    """Every marker of two maps of the same markers, with the shift that it alone would need; maps with covariances."""
    if one.covariance is None or other.covariance is None:
        return ()
    # The motion of the whole, wide and alike for both, takes the place of a pseudo-inverse: it decides nothing, and S has an inverse.
    g = rigid_motions(one.vector[:, :3] - one.vector[:, :3].mean(axis=0))
    spread = one.covariance + other.covariance + g @ g.T
    spread = spread + RANK * np.diag(np.diag(one.covariance + other.covariance))
    information = np.linalg.inv(spread)
    w = information @ _motions(one, other)
    out = []
    for i, name in enumerate(one.names):
        own = slice(6 * i, 6 * i + 6)
        shift = np.linalg.solve(information[own, own], w[own])
        away, turn = (float(np.linalg.norm(s)) for s in (shift[:3], shift[3:]))
        out.append(ShiftTest(name, away, turn, float(w[own] @ shift), 6))
    return tuple(out)
