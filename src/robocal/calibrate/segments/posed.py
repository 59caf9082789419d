"""The same for a machine whose configurations have poses of their own: a row is a configuration, its pose projected out.

    P (r + J dx + E c) = noise,    P = I - L L^+

r are all numbers that were measured at a configuration, L their columns of its pose. What may have moved: the place from which a
sensor of the machine counts (a free number of it that its making does not leave, such as the zero of a cable that slipped or of
encoders that were switched on again), or the instrument.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robocal.calibrate.segments.run import Candidate, Run
from robocal.estimate.problem import Problem
from robocal.estimate.rows import spread
from robocal.measure.base import Rows, kind_of
from robocal.measure.data import DataSet
from robocal.measure.machine import Machine
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["ZERO", "posed"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
ZERO = "zero"
FELT = 1e-9  # of a number's own standard deviation: what is less is nothing


def posed(machine: Machine, problem: Problem, data: DataSet, x: Array) -> list[Run]:
    """One run of all configurations in their order, at x (1, P); none where nothing may have moved."""
    own = {
        p for p in problem.free if p in machine.table and p not in machine.geometric and problem.table[p].unit == "m"
    }
    zeros = [p for p in problem.free if p in own]
    seen = dict.fromkeys(o.frame.name for o in data.observations if o.frame)
    frames = {name: [f"{name}.{s}" for s in FRAME_SYMBOLS] for name in seen}
    wide = problem.with_free([*problem.free, *(s for symbols in frames.values() for s in symbols)])
    laid = _laid(wide, data, x)
    if laid is None:
        return []
    parts, sigma, r, j, local = laid
    away = np.eye(r.shape[1]) - local @ np.linalg.pinv(local)
    candidates = []
    for cause, name, symbols in [(ZERO, p, [p]) for p in zeros] + [("instrument", f, s) for f, s in frames.items()]:
        plain = j[..., wide.column_of[[wide.table.index[s] for s in symbols]]]
        felt = np.flatnonzero(np.abs(plain).max(axis=(0, 1), initial=0.0) > FELT)
        if len(felt):
            candidates.append(Candidate(cause, name, away @ plain[..., felt], plain[..., felt]))
    jac = away @ j[..., wide.column_of[problem.index]]
    left = (away @ r[..., None])[..., 0]
    return [Run(data.observations[0], sigma, left, jac, tuple(candidates), parts, _origin(data, len(left)))]


Laid = tuple[tuple[tuple[int, int, str], ...], Array, Array, Array, Array]


def _laid(wide: Problem, data: DataSet, x: Array) -> Laid | None:
    """All numbers of a configuration side by side, those of one unit together, zero where there is none: parts, sigma
    and r (U, H), J (U, H, n), L (U, H, l); whitened."""
    count, size = wide.configurations, wide.sizes[0][1]
    weight = np.ones(count) if wide.weights is None else wide.weights[0]
    terms = iter(zip(wide.terms, wide.bound_terms, strict=True))
    blocks: list[tuple[str, Array, Array, Array, Array]] = []
    for obs in data.observations:
        slot, most = _slots(obs.configuration, count)
        d = kind_of(obs).size
        r, s = np.zeros((count, most, d)), np.ones((count, most, d))
        j, local = np.zeros((count, most, d, wide.n)), np.zeros((count, most, d, size))
        taken = 0
        while taken < len(obs):
            term, bound = next(terms)
            assert isinstance(term, Rows)
            m = len(term.scale)
            value, narrow, own = bound.evaluate(x, np.zeros(1, dtype=np.int64), 0, m)
            at = term.configuration, slot[term.index]
            used = (weight[term.configuration] > 0)[:, None] * term.scale
            r[at], s[at] = value[0] * used, 1 / term.scale
            j[at] = spread(narrow[0], bound.columns, wide.n) * used[..., None]
            if own.shape[-1] == size:
                local[at] = own[0] * used[..., None]
            taken += m
        for a, b, unit in kind_of(obs).parts:
            wide_as = most * (b - a)
            blocks.append((
                unit, s[:, :, a:b].reshape(count, wide_as), r[:, :, a:b].reshape(count, wide_as),
                j[:, :, a:b].reshape(count, wide_as, wide.n), local[:, :, a:b].reshape(count, wide_as, size),
            ))  # fmt: skip
    if not blocks:
        return None
    ends = np.cumsum([0, *(b[1].shape[1] for b in blocks)])
    parts = tuple((int(a), int(b), block[0]) for a, b, block in zip(ends[:-1], ends[1:], blocks, strict=True))
    sigma, r, j, local = (np.concatenate([b[i] for b in blocks], axis=1) for i in (1, 2, 3, 4))
    return parts, sigma, r, j, local


def _slots(configuration: Ints, count: int) -> tuple[Ints, int]:
    """The how many-th of its configuration each row is, and how many there are at most."""
    order = np.argsort(configuration, kind="stable")
    number = np.bincount(configuration, minlength=count)
    begin = np.concatenate([[0], np.cumsum(number)[:-1]])
    slot = np.empty(len(configuration), dtype=np.int64)
    slot[order] = np.arange(len(configuration)) - begin[configuration[order]]
    return slot, int(number.max(initial=0))


def _origin(data: DataSet, count: int) -> list[tuple[str, int]]:
    """The file and the row in it from which people know every configuration: of the first instrument that saw it."""
    out = [("", i) for i in range(count)]
    for obs in reversed(data.observations):
        rows = np.arange(len(obs)) if obs.rows is None else obs.rows
        for c, row in zip(obs.configuration[::-1].tolist(), rows[::-1].tolist(), strict=True):
            out[c] = obs.source, int(row)
    return out
