"""How much further two runs scatter than even, independent noise would have it: from sums over blocks of rows.

    x = x_true + sum_i G_i r_i,   G_i = X H J_i^T,   s_b = G_b (I - J_b H J_b^T)^(-1/2) r_b   (of the second run less that of the first)
    ratio = sum_b |s_b|^2 / sum_b tr(V_b),   V_b = sum over the runs of s^2 G_b G_b^T

What a model cannot describe is no noise: it returns at the same place, and places near each other share it. So sums over
blocks are compared with what independent errors of the same size would give, the shrinkage by the fit included. Blocks
are places, stretches of time, and parts of joint space, the latter common to both runs: an error that both met at one
place moves both estimates alike and leaves their difference, one that only one of them met does not. X turns
parameters into what is asked for. Sources: Liang and Zeger, Longitudinal data analysis (1986); Bell and McCaffrey,
Bias reduction in standard errors (2002).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.diagnose.check_registry import Context, once
from robocal.diagnose.limits import SAME_PLACES_SHARE
from robocal.estimate.elimination import reweight
from robocal.estimate.uncertainty import Total
from robocal.fit.repeats import NEAR, places
from robocal.measure.machine import Model

__all__ = ["Scatter", "WhitenedRows", "scatter", "whiten_fit"]

MOST_PLACES = 400  # rows of more are thinned evenly
BLOCKS = 10
LEAST = 1e-3  # of a row's variance: where the fit leaves less, a residual says nothing
NOTHING = 1e-9  # tolerance: of the rows of a place: rounding
FEWEST = 4  # blocks that still say something
PER_BLOCK = 4  # places, at least


@record
class WhitenedRows:
    """The rows of a fit at its solution, whitened: jacobian (R, n) over the fitted `names`, residual (R,), and the place
    of each (R,), an index into joints (P, q) in the order of the first visit; of a place with more rows than names what they say
    together, as few rows. `spread` is chi2 / dof, `enlarged` by how
    much the covariance of the fit was multiplied, `thinned` how many places stand behind each one that was kept."""

    names: tuple[str, ...]
    joints: Array
    place: Ints
    jacobian: Array
    residual: Array
    spread: float
    enlarged: float
    thinned: float = 1.0


@record
class Scatter:
    """Variance of the difference of two runs over what even noise would give: the `factor` for their covariance as
    fitted, its degrees of freedom, what blocks showed the most (`by`: place, time, joints), and the share of the second
    run's places that the first measured too."""

    factor: float
    dof: float
    by: str
    same: float


@once
def whiten_fit(context: Context[Model]) -> WhitenedRows | None:
    """The rows of a fit that tell how its errors are spread; None where places have no joint values, or rows have
    unknowns of their own."""
    fit, total = context.need_fit, context.need_fit.total
    where, problem = fit.data.configurations, fit.problem
    if where.joints is None or not problem.n or problem.blocks:
        return None
    lin = reweight(context.jacobian, problem)
    seen = fit.uncertainty
    at = [total.names.index(n) for n in problem.free]
    size = problem.scales**2
    enlarged = float(np.sum(np.diag(total.noise)[at] / size) / np.sum(np.diag(seen.covariance) / size))
    label = _by_visit(places(where), where.columns.get("time"))
    stood = np.isfinite(where.joints).all(axis=1)
    count = int(label.max(initial=-1)) + 1
    step = max(1.0, count / MOST_PLACES)
    chosen = np.unique((np.arange(min(count, MOST_PLACES)) * step).astype(np.int64))
    keep = np.flatnonzero((stood & np.isin(label, chosen))[lin.configuration])
    first = np.unique(label, return_index=True)[1][chosen]
    known = np.isfinite(where.joints[first]).all(axis=1)
    chosen, first = chosen[known], first[known]
    if not len(keep) or seen.dof <= 0:
        return None
    place, thinned = np.searchsorted(chosen, label[lin.configuration[keep]]), count / max(len(chosen), 1)
    rows, spread = _shorten(lin.j[keep], lin.r[keep], place), seen.chi2 / seen.dof
    return WhitenedRows(problem.free, where.joints[first], *rows, spread, enlarged, thinned)


def _shorten(j: Array, r: Array, place: Ints) -> tuple[Ints, Array, Array]:
    """Place, jacobian and residual of as many rows at each place as say something: Q^T of its rows j (R, n) and r (R,), Q their range.

    Every block holds whole places, and what it is asked for is the same after a turn of the rows of one.
    """
    if np.bincount(place).max() <= j.shape[1]:
        return place, j, r
    order = np.argsort(place, kind="stable")
    first = np.flatnonzero(np.diff(place[order], prepend=-1))
    parts = []
    for rows in np.split(order, first[1:]):
        own, left = j[rows], r[rows]
        if len(rows) > j.shape[1]:
            turned = np.asarray(np.linalg.qr(np.column_stack([own, left]), mode="r"))
            says = np.linalg.norm(turned[:, :-1], axis=1) > NOTHING * np.linalg.norm(turned[:, :-1])
            own, left = turned[says, :-1], turned[says, -1]
        parts.append((np.full(len(own), place[rows[0]]), own, left))
    return tuple(np.concatenate(p) for p in zip(*parts, strict=True))  # type: ignore[return-value]


def _by_visit(label: Ints, time: Array | None) -> Ints:
    """The same places numbered in the order of their first visit, by the time recorded, else by row."""
    order = np.arange(len(label)) if time is None or not np.isfinite(time).all() else np.argsort(time, kind="stable")
    _, first, inverse = np.unique(label[order], return_index=True, return_inverse=True)
    out = np.empty_like(label)
    out[order] = np.argsort(np.argsort(first))[inverse.ravel()]
    return out


def scatter(runs: Sequence[WhitenedRows], totals: Sequence[Total], names: Sequence[str], x: Array) -> Scatter:
    """The factor for the noise of x d, x (w, len(names)), d the difference of two runs in the shared `names`."""
    gains = [_gain(k, t, names, x) for k, t in zip(runs, totals, strict=True)]
    even = sum(k.spread / k.enlarged * _trace(t, names, x) for k, t in zip(runs, totals, strict=True))
    fitted = sum(_trace(t, names, x) for t in totals)
    hit, near = scipy.spatial.cKDTree(runs[0].joints).query(runs[1].joints, p=np.inf)
    met = hit < NEAR
    same = float(met.mean())
    thin = max(k.thinned for k in runs)
    found = []
    for by, labels in _labels(runs, np.where(met, near, -1), same > SAME_PLACES_SHARE).items():
        ratio, dof = _ratio(runs, gains, labels)
        # Errors that several places share add up by pairs, and thinning lost pairs in proportion.
        ratio = ratio if by == "place" else max(1 + (ratio - 1) * thin, 0.0)
        found.append(Scatter(ratio * even / fitted, dof, by, same))
    worst = max(found, key=lambda s: s.factor)
    # Only errors that both met at the same places may make the difference surer than either run.
    return worst if worst.factor > 1 or same > SAME_PLACES_SHARE else replace(worst, factor=1.0)


def _trace(total: Total, names: Sequence[str], x: Array) -> float:
    known = [i for i, n in enumerate(names) if n in total.names]
    at = [total.names.index(names[i]) for i in known]
    return float(np.sum((x[:, known] @ total.noise[np.ix_(at, at)]) * x[:, known]))


def _gain(kept: WhitenedRows, total: Total, names: Sequence[str], x: Array) -> tuple[Array, Array, Array]:
    """G (R, w) of every row, the rows' jacobian (R, n) and H (n, n)."""
    at = [total.names.index(n) for n in kept.names]
    h = total.noise[np.ix_(at, at)] / kept.enlarged
    none = np.zeros(len(x))
    mine = np.column_stack([x[:, names.index(n)] if n in names else none for n in kept.names])
    return kept.jacobian @ h @ mine.T, kept.jacobian, h


def _labels(runs: Sequence[WhitenedRows], near: Ints, again: bool) -> dict[str, tuple[Ints, Ints]]:
    """Blocks of both runs' places: (P_1,) and (P_2,) labels per way to cut; `near` is the first run's place of each of
    the second's, or -1; `again`: the second run measured the places of the first."""
    one, two = (len(k.joints) for k in runs)
    many = max(FEWEST, min(BLOCKS, min(one, two) // PER_BLOCK))
    late = np.arange(two) * many // two
    joints = np.concatenate([k.joints for k in runs])
    # Turning joints come round; a sliding joint's cosine still tells near from far.
    round_ = np.concatenate([np.cos(joints), np.sin(joints)], axis=1)
    place = np.where(near >= 0, near, one + np.arange(two))
    # Places that were visited again keep the stretch of time of their first visit.
    time = np.where(near >= 0, near * many // one, late) if again else many + late
    out = {"place": (np.arange(one), place), "time": (np.arange(one) * many // one, time)}
    if len(joints) > many:
        tree = scipy.cluster.hierarchy.linkage(round_, "ward")
        part = scipy.cluster.hierarchy.fcluster(tree, many, "maxclust").astype(np.int64)
        out["joints"] = part[:one], part[one:]
    return out


def _ratio(
    runs: Sequence[WhitenedRows], gains: Sequence[tuple[Array, Array, Array]], labels: Sequence[Ints]
) -> tuple[float, float]:
    """Observed over expected sum of squares of the blocks, and the degrees of freedom of that ratio."""
    many = 1 + max(int(v.max()) for v in labels)
    width = gains[0][0].shape[1]
    sums, spread = np.zeros((many, width)), np.zeros((many, width, width))
    for sign, kept, (g, j, h), label in zip((-1.0, 1.0), runs, gains, labels, strict=True):
        block = label[kept.place]
        for b in np.unique(block):
            rows = np.flatnonzero(block == b)
            values, vectors = np.linalg.eigh(np.eye(len(rows)) - j[rows] @ h @ j[rows].T)
            turned = vectors.T @ g[rows]
            values = np.maximum(values, LEAST)
            sums[b] += sign * turned.T @ ((vectors.T @ kept.residual[rows]) / np.sqrt(values))
            spread[b] += kept.spread * turned.T @ turned
    expected = float(np.einsum("bii->", spread))
    variance = 2 * float(np.sum(spread**2))
    if expected <= 0 or variance <= 0:
        return 1.0, np.inf
    return float(np.sum(sums**2)) / expected, 2 * expected**2 / variance
