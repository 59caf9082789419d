"""How much a visit tells of a place that is visited again: what a model leaves there is the same at every visit.

    e_pv = b_p + e_v,   var(b) = tau^2,   var(e) = sigma^2,   var(mean of m visits) = tau^2 + sigma^2 / m

Rows that measure one target at one place share b: m of them inform as much as one of variance m tau^2 + sigma^2 each. So the weight of
a configuration is

    w = (sigma^2 + tau^2) / (sigma^2 + m tau^2),   1/m <= w <= 1

Both variances follow from the residuals in units of their noise, within and between places:

    sigma^2 = S_w / f_w,   tau^2 = max(0, (S_b / f_b - sigma^2) K / N)

with S_w = sum (r - mean)^2, S_b = sum m mean^2, N rows of K places; f_w and f_b are N - K and K, less what is paid for fitted numbers: the
shared ones by places, those of a pose of its own by each. tau is zero unless F = S_b f_w / (S_w f_b) is significant, so what
honest instruments measure again counts as much as ever. Several targets seen in one configuration are several readings. Source:
Searle, Casella and McCulloch, Variance components (1992), section 3.6.
"""

from __future__ import annotations

import numpy as np

from robocal import _scipy as scipy
from robocal._types import Array, Bools, Ints
from robocal.estimate.elimination import spare_numbers
from robocal.estimate.problem import Problem
from robocal.fit.limits import PLACE_SHARE
from robocal.fit.noise import CHANCE, owners
from robocal.fit.repeats import places
from robocal.measure.data import DataSet

__all__ = ["visit_again", "weigh_visits"]


def visit_again(data: DataSet, configurations: Ints) -> bool:
    """Whether places were visited again by habit: PLACE_SHARE of these configurations have company. A few repeats, as of a place for
    checks, are rows like any."""
    label = places(data.configurations)[configurations]
    return bool((np.bincount(label)[label] > 1).sum() >= PLACE_SHARE * max(len(label), 1))


def weigh_visits(data: DataSet, problem: Problem, x: Array, configurations: Ints, columns: float) -> Array:
    """The weight of every configuration (U,), one for all but `configurations`, to which x (1, P) was fitted.

    The problem has the noise of the rows, `columns` is how many numbers were fitted.
    """
    label, even = places(data.configurations), np.ones(len(data.configurations))
    key, value, at = _readings(data, problem, x, np.isin(np.arange(len(label)), configurations), label)
    if not len(key):
        return even
    group, count = np.unique(key, return_inverse=True, return_counts=True)[1:]
    mean = np.bincount(group, value) / count
    within, between = float(np.sum((value - mean[group]) ** 2)), float(np.sum(count * mean**2))
    spare = np.full(len(label), 1.0)
    if problem.blocks:
        spare = spare_numbers(problem, x) / np.maximum(problem.numbers, 1)
    # What a pose of its own takes is taken of every visit alike.
    left = np.clip(spare[at], 0.0, 1.0)
    share = np.bincount(group, left) / count
    free_between = float(share.sum()) - columns
    free_within = float(np.sum((count - 1) * share))
    if free_within < 1 or free_between < 1:
        return even
    sigma = within / free_within
    ratio = between / free_between / sigma if sigma > 0 else np.inf
    if scipy.special.fdtrc(free_between, free_within, ratio) > CHANCE:
        return even
    tau = (between / free_between - sigma) * len(count) / len(value)
    each = ((sigma + tau) / (sigma + count * tau))[group]
    rows = np.bincount(at, minlength=len(label))
    return np.where(rows > 0, np.bincount(at, each, len(label)) / np.maximum(rows, 1), even)


def _readings(data: DataSet, problem: Problem, x: Array, chosen: Bools, label: Ints) -> tuple[Ints, Array, Ints]:
    """Every number of the chosen configurations that counts: which it is of its place, (N,), its residual in units of its noise, and its
    configuration."""
    keys, values, where = [], [], []
    first = 0
    for r, (own, term) in zip(problem.residuals(x), owners(data, problem), strict=True):
        obs = data.observations[own]
        some = np.flatnonzero(r.used & chosen[r.configuration])
        row, at = term.index[some], r.configuration[some]
        target = np.zeros(len(some), dtype=np.int64) if obs.target is None else obs.target[row]
        other = np.zeros(len(some), dtype=np.int64) if obs.second is None else label[obs.second[row]]
        # What else says which reading it is: a cable, a receiver.
        said = [
            v[row].astype(np.int64)
            for v in obs.extra.values()
            if v.ndim == 1 and v.dtype.kind in "if" and not np.mod(v, 1).any()
        ]
        which = _number(target, other, *said)
        # The first such row of every visit, the second, ...: a reading that is repeated in one visit tells as much as ever.
        same = _number(at, which)
        order = np.argsort(same, kind="stable")
        starts = np.flatnonzero(np.append(True, np.diff(same[order]) > 0))[: len(some)]
        turn = np.empty(len(some), dtype=np.int64)
        turn[order] = np.arange(len(some)) - np.repeat(starts, np.diff(np.append(starts, len(some))))
        mine = _number(label[at], which, turn)
        white = r.white[some]
        width = white.shape[1]
        keys.append((first + mine[:, None] * width + np.arange(width)).ravel())
        first += (int(mine.max(initial=-1)) + 1) * width
        values.append(white.ravel())
        where.append(np.repeat(at, width))
    return np.concatenate(keys), np.concatenate(values), np.concatenate(where)


def _number(*columns: Ints) -> Ints:
    """Which of the different rows of some columns (N,) each is, in ascending order."""
    out = np.zeros(len(columns[0]), dtype=np.int64)
    for column in columns:
        if len(out) and column.min() < column.max():
            own = np.unique(column, return_inverse=True)[1]
            out = np.unique(out * (int(own.max()) + 1) + own, return_inverse=True)[1]
    return out
