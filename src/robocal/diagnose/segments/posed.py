"""The same for a machine whose configurations have poses of their own: a row is a configuration, its pose projected out.

    B^T (r + J dx + E c) = noise,    B^T B = I,  B^T L = 0

r are all numbers that were measured at a configuration, L their columns of its pose, B a basis of what the pose does not touch: as
many numbers of equal noise as the readings are more than a pose needs. What may have moved: the place from which a
sensor of the machine counts (a free number of it that its making does not leave, such as the zero of a cable that slipped or of
encoders that were switched on again), or the instrument.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robocal._types import Array, Ints
from robocal.diagnose.limits import SEGMENT_COMPLETE
from robocal.diagnose.segments.row_sequence import Candidate, Plain, RowSequence
from robocal.estimate.problem import Problem
from robocal.estimate.terms import spread
from robocal.measure.base import Kind, Rows, kind_of
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["ZERO", "runs_of_poses"]

ZERO = "zero"
FELT = 1e-9  # tolerance: of a number's own standard deviation: what is less is nothing


def runs_of_poses(machine: Model, problem: Problem, data: DataSet, x: Array) -> list[RowSequence]:
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
    parts, sigma, r, j, local, there = laid
    size = local.shape[2]
    if r.shape[1] <= size or there.mean() < SEGMENT_COMPLETE:
        return []
    beside = np.linalg.svd(local, full_matrices=True)[0][:, :, size:].swapaxes(1, 2)
    candidates = []
    for cause, name, symbols in [(ZERO, p, [p]) for p in zeros] + [("instrument", f, s) for f, s in frames.items()]:
        plain = j[..., wide.column_of[[wide.table.index[s] for s in symbols]]]
        felt = np.flatnonzero(np.abs(plain).max(axis=(0, 1), initial=0.0) > FELT)
        if len(felt):
            candidates.append(Candidate(cause, name, beside @ plain[..., felt], Plain(plain[..., felt], sigma, parts)))
    jac = beside @ j[..., wide.column_of[problem.index]]
    left = (beside @ r[..., None])[..., 0]
    whole = ((0, left.shape[1], "1"),)
    return [
        RowSequence(
            data.observations[0], np.ones_like(left), left, jac, tuple(candidates), whole, _origin(data, len(left))
        )
    ]


Laid = tuple[tuple[tuple[int, int, str], ...], Array, Array, Array, Array, NDArray[np.bool_]]


def _laid(wide: Problem, data: DataSet, x: Array) -> Laid | None:
    """All numbers of a configuration side by side, those of one unit together, zero where there is none: parts, sigma
    and r (U, H), J (U, H, n), L (U, H, l), whitened, and where there are any (U, H)."""
    count, size = wide.configurations, wide.sizes[0][1]
    weight = np.ones(count) if wide.weights is None else wide.weights[0]
    terms = iter(zip(wide.terms, wide.bound_terms, strict=True))
    blocks: dict[str, _Block] = {}
    for obs in data.observations:
        # Files of one kind share their columns: the same sensors, at other configurations.
        if obs.kind not in blocks:
            every = np.concatenate([o.configuration for o in data.observations if o.kind == obs.kind])
            blocks[obs.kind] = _Block.empty(count, _slots(every, count), kind_of(obs), wide.n, size)
        block, taken = blocks[obs.kind], 0
        slot = block.taken(len(obs))
        while taken < len(obs):
            term, bound = next(terms)
            assert isinstance(term, Rows)
            m = len(term.scale)
            value, narrow, own = bound.evaluate(x, np.zeros(1, dtype=np.int64), 0, m)
            at = term.configuration, slot[term.index]
            used = (weight[term.configuration] > 0)[:, None] * term.scale
            block.r[at], block.sigma[at] = value[0] * used, 1 / term.scale
            block.j[at] = spread(narrow[0], bound.columns, wide.n) * used[..., None]
            if own.shape[-1] == size:
                block.local[at] = own[0] * used[..., None]
            taken += m
    if not blocks:
        return None
    laid = [part for block in blocks.values() for part in block.parts()]
    ends = np.cumsum([0, *(part[1].shape[1] for part in laid)])
    parts = tuple((int(a), int(b), part[0]) for a, b, part in zip(ends[:-1], ends[1:], laid, strict=True))
    sigma, r, j, local = (np.concatenate([part[i] for part in laid], axis=1) for i in (1, 2, 3, 4))
    return parts, sigma, r, j, local, np.isfinite(sigma)


@dataclass(eq=False)
class _Block:
    """The numbers of one kind side by side: sigma and r (U, s, d), j (U, s, d, n), local (U, s, d, l); `slot` of all its rows, those of
    one file after the other."""

    kind: Kind
    slot: Ints
    sigma: Array
    r: Array
    j: Array
    local: Array
    used: int = 0

    @classmethod
    def empty(cls, count: int, slots: tuple[Ints, int], kind: Kind, n: int, size: int) -> _Block:
        """Nothing yet."""
        slot, most = slots
        shape = (count, most, kind.size)
        return cls(kind, slot, np.full(shape, np.inf), np.zeros(shape), np.zeros((*shape, n)), np.zeros((*shape, size)))

    def taken(self, rows: int) -> Ints:
        """The slots of the next rows."""
        self.used += rows
        return self.slot[self.used - rows : self.used]

    def parts(self) -> list[tuple[str, Array, Array, Array, Array]]:
        """Those of one unit side by side: unit, sigma, r, j, local."""
        out = []
        for a, b, unit in self.kind.parts:
            count, wide = len(self.r), self.r.shape[1] * (b - a)
            out.append((
                unit, self.sigma[:, :, a:b].reshape(count, wide), self.r[:, :, a:b].reshape(count, wide),
                self.j[:, :, a:b].reshape(count, wide, self.j.shape[3]),
                self.local[:, :, a:b].reshape(count, wide, self.local.shape[3]),
            ))  # fmt: skip
        return out


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
