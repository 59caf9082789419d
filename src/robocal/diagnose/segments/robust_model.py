"""A robust linear fit of everything free, and of the segments found so far; every gain is asked of it.

    gain(a, b) = s^T I^-1 s,    s = E^T r',   I = E^T E - E^T J (J^T J + P)^-1 J^T E        rows a to b of one file

Rows are in units of what the fit leaves of them (per file and per unit of measurement), rows far outside weigh less.
"""

from __future__ import annotations

import math
from copy import copy
from functools import cached_property
from itertools import pairwise

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.diagnose.limits import SEGMENT_NUMBERS, SEGMENT_ROWS
from robocal.diagnose.segments.row_sequence import Candidate, RowSequence
from robocal.fit.noise import median

__all__ = ["SegmentFit", "SegmentModel", "spread"]

GRID = 48
CLIP = 3.0  # robust standard deviations from which on a row pulls no harder
FLAT = 0.1  # of a column's own information: what the model answers but for this much is not seen
FEWEST = 1e-3  # share of the rows that the fewer are taken for at least
ROUNDS = 4
EPS = 1e-12  # tolerance: of the largest eigenvalue
CLEAR = 1e-9  # tolerance: of the smallest pivot: so far above EPS every direction is known, and the triangle's inverse is a root


@record(eq=False)
class SegmentFit:
    """A segment a <= i < b of a run, its candidate, gain and the part of its step that the model cannot
    answer, `unexplained` (q,), and the segment of another cause that explains as much."""

    run: RowSequence
    candidate: Candidate
    a: int
    b: int
    gain: float
    unexplained: Array
    sums: _Sums  # up to nothing, the two ends, and everything
    ends: tuple[int, int]  # among the candidate's rows
    rival: SegmentFit | None = None

    @property
    def place(self) -> tuple[Candidate, int, int]:
        """Of which candidate it is, and where."""
        return self.candidate, self.a, self.b

    @cached_property
    def step(self) -> Array:
        """How far it moved, (q,)."""
        return self.sums.step(1, 2)

    @property
    def cost(self) -> float:
        """What its columns explain by chance."""
        _, d, q = self.candidate.column.shape
        return float(q * math.log(self.run.count * d * q))

    @property
    def column(self) -> Array:
        """The candidate's columns on the segment, 0 elsewhere (k, d, q)."""
        inside = np.zeros(len(self.candidate.column))
        inside[self.a : self.b] = 1.0
        return self.candidate.column * inside[:, None, None]


class SegmentModel:
    """Residuals `left` (k, d) of every run in units of themselves, `unit` (d,) those units, `weight` (k,) of the rows, and
    `root` (n, n), the inverse square root of the information; `jacobian` (k, d, m) has the columns `own` (m,) that a run feels."""

    def __init__(self, runs: list[RowSequence], jacobian: list[Array], own: list[Ints], info: Array) -> None:
        self.runs, self.jacobian, self.own, self.info = runs, jacobian, own, info
        self.weight = [r.share for r in runs]
        self.unit = [np.ones(r.residual.shape[1]) for r in runs]
        self._solve()
        for _ in range(ROUNDS):
            self._reweigh()
            self._solve()

    @classmethod
    def of(cls, runs: list[RowSequence], info: Array) -> SegmentModel:
        """The model of everything free, (n,) numbers that hold it."""
        own = [np.flatnonzero((r.jacobian != 0).any(axis=(0, 1))) for r in runs]
        felt = [r.jacobian if len(o) == len(info) else r.jacobian[..., o] for r, o in zip(runs, own, strict=True)]
        return cls(runs, felt, own, info)

    def with_segments(self, *some: SegmentFit) -> SegmentModel:
        """The model with segments taken into it."""
        return self.with_columns([(f.run, f.column) for f in some])

    def with_columns(self, more: list[tuple[RowSequence, Array]]) -> SegmentModel:
        """The model with more columns, each (k, d, q) of one run, not held."""
        jacobian, own, n = list(self.jacobian), list(self.own), len(self.info)
        for run, column in more:
            i, q = self.runs.index(run), column.shape[2]
            jacobian[i] = np.concatenate([jacobian[i], column], axis=2)
            own[i] = np.append(own[i], np.arange(n, n + q))
            n += q
        return SegmentModel(self.runs, jacobian, own, np.pad(self.info, (0, n - len(self.info))))

    def _solve(self) -> None:
        """One weighted linear fit; weights, units and root belong together."""
        a, b, count = np.diag(self.info), np.zeros(len(self.info)), 0.0
        for run, j, own, w, unit in zip(self.runs, self.jacobian, self.own, self.weight, self.unit, strict=True):
            scale = np.sqrt(w)[:, None] / unit
            rows = (j * scale[..., None]).reshape(-1, j.shape[2])
            a[np.ix_(own, own)] += rows.T @ rows
            b[own] += rows.T @ (run.residual * scale).ravel()
            count += run.count * run.residual.shape[1]
        self.root = _inverse_root(a)
        dx = self.root @ (self.root.T @ b)
        self.used = float(self.root.shape[1] - self.info @ (self.root**2).sum(axis=1))
        self.share = math.sqrt(max(1 - self.used / max(count, 1.0), 0.05))
        parts = zip(self.runs, self.jacobian, self.own, self.unit, strict=True)
        self.left = [(r.residual - j @ dx[own]) / u for r, j, own, u in parts]

    def _reweigh(self) -> None:
        """Units in which rows scatter by one, and less weight for those far outside."""
        for i, run in enumerate(self.runs):
            left = self.left[i] * self.unit[i]
            # Too few rows to speak for themselves keep the noise as it was fitted.
            if len(left) >= 2 * SEGMENT_ROWS:
                unit = [max(spread(left[:, a:b]) / self.share, EPS) for a, b, _ in run.parts for _ in range(a, b)]
                self.unit[i] = np.array(unit)
            far = np.sqrt(np.mean((left / self.unit[i]) ** 2, axis=1))
            self.weight[i] = run.share * np.minimum(1.0, CLIP / np.maximum(far, EPS))

    def misfit(self, run: RowSequence) -> float:
        """What a file's rows leave, as -2 log of their likelihood, rows far outside bounded."""
        i = self.runs.index(run)
        bounded = np.minimum(np.abs(self.left[i]), CLIP)
        return 2 * run.count * float(np.log(self.unit[i]).sum()) + float(run.share @ (bounded**2).sum(axis=1))

    def chance(self, found: SegmentFit) -> float:
        """Of so large a gain where nothing moved, by what the segment would leave of its file, not asking how many were tried."""
        q, d = found.column.shape[2], found.column.shape[1]
        dof = max(found.run.count * d - self.used - q, 1.0)
        beyond = math.expm1(min(self.evidence(found) / (found.run.count * d), 100.0))
        return float(scipy.special.fdtrc(q, dof, beyond * dof / q))

    def evidence(self, found: SegmentFit) -> float:
        """2 log of the likelihood ratio of a segment, where nobody knows the noise of any unit: the gain itself, of many rows."""
        i = self.runs.index(found.run)
        answer = self.root[self.own[i]] @ (found.sums.answer(1, 2).T @ found.unexplained)
        then = self.left[i] - (found.column @ found.unexplained - self.jacobian[i] @ answer) / self.unit[i]
        squares = (self.weight[i] @ left**2 for left in (self.left[i], then))
        before, after = ([float(v[p:r].sum()) for p, r, _ in found.run.parts] for v in squares)
        fall = (
            (r - p) * math.log(max(x, EPS) / max(y, EPS * max(x, EPS)))
            for (p, r, _), x, y in zip(found.run.parts, before, after, strict=True)
        )
        return found.run.count * sum(fall)

    def in_units_of(self, other: SegmentModel) -> SegmentModel:
        """The same with the weights and the units of another model."""
        model = copy(self)
        model.weight, model.unit = other.weight, other.unit
        model._solve()
        return model

    def segment(self, run: RowSequence, c: Candidate) -> SegmentFit | None:
        """The segment of one file and cause that gains most."""
        rows = c.rows
        k = len(rows)
        if k < 2 * SEGMENT_ROWS:
            return None
        sums = _Sums.of(*self._rows(run, c))
        marks = np.unique(np.linspace(0, k, min(GRID, k // 2) + 1).astype(np.int64))
        a, b = (marks[m] for m in np.triu_indices(len(marks), 1))
        ends = sums.best(a, b)
        if ends is None:
            return None
        first, last = _sharpen_ends(sums, *ends, 2 * int(np.diff(marks).max()))
        # What stood elsewhere before a row, or from that row on, is one and the same: the later rows are named.
        ends = (last, k) if first == 0 else (first, last)
        return sums.take([0, *ends, k]).fit(run, c, (int(rows[ends[0]]), int(rows[ends[1] - 1]) + 1), ends)

    def whole_file(self, run: RowSequence, c: Candidate, a: int, b: int) -> SegmentFit:
        """The segment of rows a to b, which are a file of their own."""
        first, last = np.searchsorted(c.rows, (a, b)).tolist()
        return self._between(run, c, first, last).fit(run, c, (a, b), (first, last))

    def refit(self, found: SegmentFit) -> SegmentFit:
        """The same segment by this model."""
        run, c = found.run, found.candidate
        return replace(
            self._between(run, c, *found.ends).fit(run, c, (found.a, found.b), found.ends), rival=found.rival
        )

    def shared(self, run: RowSequence, c: Candidate, profile: Array) -> float:
        """The gain where each row of a candidate moved by a share of its own, (k,)."""
        column, *more = self._rows(run, c)
        sums = _Sums.at((0, len(column)), column * profile[:, None, None], *more)
        return float(sums.gain(np.array([0]), np.array([1]))[0][0])

    def _between(self, run: RowSequence, c: Candidate, first: int, last: int) -> _Sums:
        """Of the rows of a candidate, up to nothing, two ends, and everything."""
        return _Sums.at((0, first, last, len(c.rows)), *self._rows(run, c))

    def _rows(self, run: RowSequence, c: Candidate) -> tuple[Array, Array, Array, Array, Array, Array]:
        """The rows of a candidate: its columns, what is left, weights, units, the Jacobian (k, d, m), and the root (m, n)."""
        i, rows = self.runs.index(run), c.rows
        # Of what all rows see no copy is made.
        some: slice | Ints = slice(None) if len(rows) == len(self.weight[i]) else rows
        left, weight, root = self.left[i][some], self.weight[i][some], self.root[self.own[i]]
        return c.column[some], left, weight, self.unit[i], self.jacobian[i][some], root


def _inverse_root(a: Array) -> Array:
    """W (n, k) with W W^T the inverse of an information (n, n), of the k directions that it knows; any such root will do."""
    size = np.sqrt(np.where(np.diag(a) > 0, np.diag(a), 1.0))
    a = a / np.outer(size, size)
    try:
        root = np.linalg.cholesky(a)
        if np.diag(root).min(initial=1.0) ** 2 > CLEAR:
            return np.asarray(np.linalg.inv(root).T / size[:, None])
    except np.linalg.LinAlgError:
        pass
    values, vectors = np.linalg.eigh(a)
    kept = values > EPS * values[-1]
    return np.asarray((vectors[:, kept] / np.sqrt(values[kept])) / size[:, None])


def spread(left: Array) -> float:
    """Standard deviation per axis from the median of squared lengths, which outliers do not move."""
    square = np.einsum("kd,kd->k", left, left)
    some = square[square > 0]
    return math.sqrt(median(some) / float(scipy.special.chdtri(left.shape[1], 0.5))) if len(some) else EPS


@record
class _Sums:
    """Running sums over rows, so that every segment is a difference of two."""

    score: Array  # (k + 1, q)
    own: Array  # (k + 1, q, q)
    cross: Array  # (k + 1, q, m)
    root: Array  # (m, n): the model's answer is that of cross times it
    fewest: int  # rows of a segment, and beside it

    @classmethod
    def of(cls, column: Array, left: Array, weight: Array, unit: Array, jacobian: Array, root: Array) -> _Sums:
        def running(v: Array, by: Array) -> Array:
            """The sums up to each row of v by, in place: of many rows the products alone fill the memory."""
            out = np.zeros((len(v) + 1, v.shape[1], by.shape[2]))
            np.matmul(v, by, out=out[1:])
            np.cumsum(out[1:], axis=0, out=out[1:])
            return out

        turned = (column * (weight[:, None] / unit)[..., None]).transpose(0, 2, 1)
        fewest = max(SEGMENT_ROWS, math.ceil(SEGMENT_NUMBERS * column.shape[2] / column.shape[1]))
        score = running(turned, left[..., None])
        turned = turned / unit  # which takes less than a copy of the Jacobian in units
        return cls(score[..., 0], running(turned, column), running(turned, jacobian), root, fewest)

    @classmethod
    def at(
        cls, ends: tuple[int, ...], column: Array, left: Array, weight: Array, unit: Array, jac: Array, root: Array
    ) -> _Sums:
        """The sums up to some rows alone, (e,), 0 the first."""
        d, q = column.shape[1:]
        turned = column * (weight[:, None] / unit)[..., None]

        def up_to(t: Array, v: Array) -> Array:
            flat, parts = t.reshape(-1, q).T, (slice(a * d, b * d) for a, b in pairwise((0, *ends)))
            return np.cumsum([flat[:, part] @ v.reshape(flat.shape[1], -1)[part] for part in parts], axis=0)

        score = up_to(turned, left)[..., 0]
        turned = turned / unit[:, None]
        return cls(score, up_to(turned, column), up_to(turned, jac), root, 0)

    def take(self, ends: list[int]) -> _Sums:
        """The same up to some rows alone."""
        return replace(self, score=self.score[ends], own=self.own[ends], cross=self.cross[ends])

    def answer(self, a: Ints | int, b: Ints | int) -> Array:
        """What the model answers of segments a <= i < b, (..., q, n)."""
        return np.asarray((self.cross[b] - self.cross[a]) @ self.root)

    def fit(self, run: RowSequence, c: Candidate, rows: tuple[int, int], ends: tuple[int, int]) -> SegmentFit:
        """The segment of some rows of a run, between these `ends` among the rows of its candidate, of sums up to nothing, these and
        everything."""
        gain, held = self.gain(np.array([1]), np.array([2]))
        return SegmentFit(run, c, *rows, float(gain[0]), held[0], self, ends)

    def gain(self, a: Ints, b: Ints) -> tuple[Array, Array]:
        """Gain (p,) and step (p, q) of segments a <= i < b; directions that the model answers almost whole are held."""
        score = self.score[b] - self.score[a]
        own = self.own[b] - self.own[a]
        info = own - self._model_products(a, b)
        diagonal, total = np.einsum("pqq->pq", own), np.diag(self.own[-1])
        size = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
        # Of a step in most rows, as much is seen as of one in the few others.
        least = FLAT * np.clip((total - diagonal) / size**2, FEWEST, 1.0)
        held = info / (size[:, :, None] * size[:, None, :]) + least[:, :, None] * np.eye(own.shape[1])
        step = np.linalg.solve(held, (score / size)[..., None])[..., 0] / size
        return np.einsum("pq,pq->p", score, step), step

    def _model_products(self, a: Ints, b: Ints) -> Array:
        """What the model answers of segments, C C^T with C = answer(a, b), (p, q, q); of many pairs of few ends, from the products of
        the ends."""
        q = self.cross.shape[1]
        ends, at = np.unique(np.concatenate([a, b]), return_inverse=True)
        # Where one end of all pairs is the same, the ends outnumber the pairs: their products would fill the memory.
        if len(ends) ** 2 > 4 * len(a):
            cross = self.answer(a, b)
            return np.asarray(cross @ cross.transpose(0, 2, 1))
        flat = self.cross[ends].reshape(len(ends) * q, -1) @ self.root
        products = (flat @ flat.T).reshape(len(ends), q, len(ends), q).transpose(0, 2, 1, 3)
        first, last = at[: len(a)], at[len(a) :]
        mixed = products[first, last]
        return np.asarray(products[first, first] + products[last, last] - mixed - mixed.transpose(0, 2, 1))

    def step(self, a: int, b: int) -> Array:
        """The step (q,) of one segment with less of that hold: what is seen at all, is seen whole (iterated Tikhonov)."""
        whole = self.score[b] - self.score[a]
        cross = self.answer(a, b)
        info = self.own[b] - self.own[a] - cross @ cross.T
        found = np.zeros(len(whole))
        for _ in range(4):
            rest = replace(self, score=self.score - self.score)
            rest.score[b] += whole - info @ found
            found = found + rest.gain(np.array([a]), np.array([b]))[1][0]
        return found

    def best(self, a: Ints, b: Ints) -> tuple[int, int] | None:
        """The pair that gains most, with enough rows inside and outside."""
        k = len(self.score) - 1
        fit = (b - a >= self.fewest) & (k - (b - a) >= self.fewest)
        if not fit.any():
            return None
        at = int(self.gain(a[fit], b[fit])[0].argmax())
        return int(a[fit][at]), int(b[fit][at])


def _sharpen_ends(sums: _Sums, first: int, last: int, near: int) -> tuple[int, int]:
    """The ends of a segment row by row, one end after the other until both stay."""
    k = len(sums.score) - 1
    for _ in range(4):
        before = first, last
        tried = np.arange(max(first - near, 0), min(first + near, last) + 1)
        first, last = sums.best(tried, np.full_like(tried, last)) or before
        tried = np.arange(max(last - near, first), min(last + near, k) + 1)
        first, last = sums.best(np.full_like(tried, first), tried) or (first, last)
        if (first, last) == before:
            break
    return first, last
