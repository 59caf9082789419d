"""A robust linear fit of everything free, and of the segments found so far; every gain is asked of it.

    gain(a, b) = s^T I^-1 s,    s = E^T r',   I = E^T E - E^T J (J^T J + P)^-1 J^T E        rows a to b of one file

Rows are in units of what the fit leaves of them (per file and per unit of measurement), rows far outside weigh less.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import copy
from functools import cached_property

import numpy as np

from robocal import _scipy as scipy
from robocal._record import field, record, replace
from robocal._types import Array, Ints
from robocal.diagnose.limits import SEGMENT_ROWS
from robocal.diagnose.segments.row_sequence import Candidate, RowSequence
from robocal.diagnose.segments.running_sums import RunningSums, SegmentScan
from robocal.fit.noise import median

__all__ = ["SegmentFit", "SegmentModel", "spread"]

SMALL = 24  # grid: columns of a triangle that is inverted at once
GLANCE = 64  # rows from one to the next that is looked at before all of them are
CLIP = 3.0  # robust standard deviations from which on a row pulls no harder
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
    sums: RunningSums  # up to nothing, the two ends, and everything
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


@record(eq=False)
class _Columns:
    """Columns of the model, of the rows of a run: values (k, d, m), their numbers, `own` (m,), and what the rows of candidates feel."""

    values: Array
    own: Ints
    felt: dict[Candidate, tuple[Array, Ints]] = field(default_factory=dict)

    def felt_by(self, c: Candidate) -> tuple[Array, Ints]:
        """Of the rows of a candidate, those columns (k, d, m) that they feel, and their numbers, (m,)."""
        if c not in self.felt:
            some = self.values if len(c.rows) == len(self.values) else self.values[c.rows]
            felt = some[::GLANCE].any(axis=(0, 1))
            felt = felt if felt.all() else some.any(axis=(0, 1))
            self.felt[c] = some if felt.all() else some[..., felt], self.own[felt]
        return self.felt[c]


@record(eq=False)
class _Design:
    """All columns of the model that a run feels, and what its residual and they give by unit, where no row weighs less for being far
    outside: `products` (parts, m, m) of the columns, and `pull` (parts, m) of each with the residual."""

    columns: tuple[_Columns, ...]
    products: Array
    pull: Array

    @classmethod
    def of(cls, run: RowSequence) -> _Design:
        own = np.flatnonzero((run.jacobian != 0).any(axis=(0, 1)))
        felt = run.jacobian if len(own) == run.jacobian.shape[2] else run.jacobian[..., own]
        return cls((_Columns(felt, own),), _products(run, felt, run.share), _pulls(run, felt, run.share))

    @cached_property
    def own(self) -> Ints:
        """The numbers of the columns, (m,)."""
        return np.concatenate([c.own for c in self.columns])

    def rows(self, some: slice | Ints) -> Array:
        """Some rows of all columns, (., d, m)."""
        return np.concatenate([c.values[some] for c in self.columns], axis=2)

    def times(self, dx: Array) -> Array:
        """What the columns do to the rows, (k d,), at dx (n,)."""
        first, *more = (_flat(c.values) @ dx[c.own] for c in self.columns)
        for part in more:
            first += part
        return np.asarray(first)

    def widen(self, run: RowSequence, column: Array, own: Ints) -> _Design:
        """The same with more columns (k, d, q), not zero on rows that lie together."""
        felt = np.flatnonzero(column.any(axis=(1, 2)))
        some, q = slice(int(felt[0]), int(felt[-1]) + 1) if len(felt) else slice(0), column.shape[2]
        products = np.pad(self.products, ((0, 0), (0, q), (0, q)))
        heavy = column[some] * run.share[some, None, None]
        for (first, stop, _), out in zip(run.parts, products, strict=True):
            by = heavy[:, first:stop].reshape(-1, q)
            rows = [c.values[some, first:stop].reshape(len(by), -1) for c in self.columns]
            out[:, -q:] = np.concatenate([r.T @ by for r in (*rows, column[some, first:stop].reshape(-1, q))])
            out[-q:] = out[:, -q:].T
        pull = np.concatenate([self.pull, _pulls(run, column, run.share)], axis=1)
        return _Design((*self.columns, _Columns(column, own)), products, pull)


class SegmentModel:
    """Residuals `left` (k, d) of every run in units of themselves, `unit` (d,) those units, `weight` (k,) of the rows, and
    `root` (n, n), the inverse square root of the information; `design` has the columns that a run feels."""

    def __init__(self, runs: list[RowSequence], design: list[_Design], info: Array) -> None:
        self.runs, self.design, self.info = runs, design, info
        self.weight = [r.share for r in runs]
        self.unit = [np.ones(r.residual.shape[1]) for r in runs]
        self._solve()
        for _ in range(ROUNDS):
            self._reweigh()
            self._solve()

    @classmethod
    def of(cls, runs: list[RowSequence], info: Array) -> SegmentModel:
        """The model of everything free, (n,) numbers that hold it."""
        return cls(runs, [_Design.of(r) for r in runs], info)

    def with_segments(self, *some: SegmentFit) -> SegmentModel:
        """The model with segments taken into it."""
        return self.with_columns([(f.run, f.column) for f in some])

    def with_columns(self, more: list[tuple[RowSequence, Array]]) -> SegmentModel:
        """The model with more columns, each (k, d, q) of one run, not held."""
        design, n = list(self.design), len(self.info)
        for run, column in more:
            i, q = self.runs.index(run), column.shape[2]
            design[i] = design[i].widen(run, column, np.arange(n, n + q))
            n += q
        return SegmentModel(self.runs, design, np.pad(self.info, (0, n - len(self.info))))

    def _solve(self) -> None:
        """One weighted linear fit; weights, units and root belong together."""
        a, b, count = np.diag(self.info), np.zeros(len(self.info)), 0.0
        for run, design, w, unit in zip(self.runs, self.design, self.weight, self.unit, strict=True):
            whole, pull, own = design.products, design.pull, design.own
            less = run.share - w
            far = np.flatnonzero(less)
            if len(far):  # of a few rows what they lack is asked, instead of the sums over all
                some = design.rows(far)
                whole = whole - _products(run, some, less[far])
                pull = pull - _pulls(run, some, less[far], far)
            square = unit[[p for p, *_ in run.parts]] ** -2.0
            here = slice(None) if len(own) == len(b) else np.ix_(own, own)
            a[here] += (square @ whole.reshape(len(square), -1)).reshape(whole.shape[1:])
            b[own] += square @ pull
            count += run.count * run.residual.shape[1]
        self.root = _inverse_root(a)
        dx = self.root @ (self.root.T @ b)
        self.used = float(self.root.shape[1] - self.info @ (self.root**2).sum(axis=1))
        self.share = math.sqrt(max(1 - self.used / max(count, 1.0), 0.05))
        each = zip(self.runs, self.design, self.unit, strict=True)
        self.left = [(r.residual - d.times(dx).reshape(r.residual.shape)) / u for r, d, u in each]

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

    def chance(self, found: SegmentFit, evidence: float) -> float:
        """Of so much evidence where nothing moved, by what the segment would leave of its file, not asking how many were tried."""
        q, d = found.column.shape[2], found.column.shape[1]
        dof = max(found.run.count * d - self.used - q, 1.0)
        beyond = math.expm1(min(evidence / (found.run.count * d), 100.0))
        return float(scipy.special.fdtrc(q, dof, beyond * dof / q))

    def evidence(self, found: SegmentFit) -> float:
        """2 log of the likelihood ratio of a segment, where nobody knows the noise of any unit: the gain itself, of many rows."""
        i = self.runs.index(found.run)
        pull = (found.sums.cross[2] - found.sums.cross[1]).T @ found.unexplained
        own = np.concatenate([columns.felt_by(found.candidate)[1] for columns in self.design[i].columns])
        answer = self.root @ (self.root[own].T @ pull)
        moved = -self.design[i].times(answer).reshape(found.run.residual.shape)
        moved[found.a : found.b] += found.candidate.column[found.a : found.b] @ found.unexplained
        then = self.left[i] - moved / self.unit[i]
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
        looked = self._rows(run, c)
        ends = SegmentScan(*looked).find()
        if ends is None:
            return None
        # What stood elsewhere before a row, or from that row on, is one and the same: the later rows are named.
        first, last = ends = (ends[1], k) if ends[0] == 0 else ends
        sums = RunningSums.at((0, first, last, k), *looked)
        return _fit(run, c, (int(rows[first]), int(rows[last - 1]) + 1), sums, ends)

    def whole_file(self, run: RowSequence, c: Candidate, a: int, b: int) -> SegmentFit:
        """The segment of rows a to b, which are a file of their own."""
        first, last = np.searchsorted(c.rows, (a, b)).tolist()
        return _fit(run, c, (a, b), self._between(run, c, first, last), (first, last))

    def refit(self, found: SegmentFit) -> SegmentFit:
        """The same segment by this model."""
        run, c = found.run, found.candidate
        sums = self._between(run, c, *found.ends)
        return replace(_fit(run, c, (found.a, found.b), sums, found.ends), rival=found.rival)

    def shared(self, run: RowSequence, c: Candidate) -> Callable[[Array], float]:
        """The gain where each row of a candidate moved by a share of its own, (k,)."""
        column, left, weight, j, root = self._rows(run, c)

        def gain(profile: Array) -> float:
            sums = RunningSums.at((0, len(left)), column * profile[:, None, None], left, weight, j, root)
            return sums.gain(0, 1)[0]

        return gain

    def _between(self, run: RowSequence, c: Candidate, first: int, last: int) -> RunningSums:
        """Of the rows of a candidate, up to nothing, two ends, and everything."""
        return RunningSums.at((0, first, last, len(c.rows)), *self._rows(run, c))

    def _rows(self, run: RowSequence, c: Candidate) -> tuple[Array, Array, Array, list[Array], Array]:
        """The rows of a candidate: its columns, what is left, weights (k, d) by their units, the columns (k, d, m) of the model that they
        feel, and a root (m, .) of those."""
        i, rows = self.runs.index(run), c.rows
        # Of what all rows see no copy is made.
        some: slice | Ints = slice(None) if len(rows) == len(self.weight[i]) else rows
        unit = self.unit[i]
        left, weight = self.left[i][some] * unit, self.weight[i][some, None] / unit**2
        jacobian, own = zip(*(columns.felt_by(c) for columns in self.design[i].columns), strict=True)
        root = self.root[np.concatenate(own)]
        if root.shape[1] > len(root):  # any root of the same will do
            root = np.asarray(np.linalg.qr(root.T, mode="r")).T
        return c.column[some], left, weight, list(jacobian), root


def _fit(run: RowSequence, c: Candidate, rows: tuple[int, int], sums: RunningSums, ends: tuple[int, int]) -> SegmentFit:
    """The segment of some rows of a run, between these `ends` among the rows of its candidate, of sums up to nothing, these and
    everything."""
    return SegmentFit(run, c, *rows, *sums.gain(1, 2), sums, ends)


def _flat(j: Array) -> Array:
    """The rows of a Jacobian (k, d, m) as one matrix (k d, m)."""
    return j.reshape(j.shape[0] * j.shape[1], j.shape[2])


def _products(run: RowSequence, j: Array, by: Array) -> Array:
    """The products (parts, m, m) of the columns of some rows j (k, d, m) in each unit, each row times `by` (k,)."""
    heavy = j * np.sqrt(by)[:, None, None]
    rows = [_flat(heavy[:, first:stop]) for first, stop, _ in run.parts]
    return np.array([r.T @ r for r in rows])


def _pulls(run: RowSequence, j: Array, by: Array, some: slice | Ints = slice(None)) -> Array:
    """The products (parts, m) of the columns of some rows j (k, d, m) with their residuals in each unit, each row times `by` (k,)."""
    r = run.residual[some] * by[:, None]
    return np.array([_flat(j[:, first:stop]).T @ r[:, first:stop].ravel() for first, stop, _ in run.parts])


def _inverse_root(a: Array) -> Array:
    """W (n, k) with W W^T the inverse of an information (n, n), of the k directions that it knows; any such root will do."""
    size = np.sqrt(np.where(np.diag(a) > 0, np.diag(a), 1.0))
    a = a / np.outer(size, size)
    try:
        root = np.linalg.cholesky(a)
        if np.diag(root).min(initial=1.0) ** 2 > CLEAR:
            return np.asarray(_inverse(np.asarray(root)).T / size[:, None])
    except np.linalg.LinAlgError:
        pass
    values, vectors = np.linalg.eigh(a)
    kept = values > EPS * values[-1]
    return np.asarray((vectors[:, kept] / np.sqrt(values[kept])) / size[:, None])


def _inverse(lower: Array) -> Array:
    """Of a lower triangle, by halves: most of it is products, several times as fast as what knows no triangle."""
    half = len(lower) // 2
    if half < SMALL:
        return np.asarray(np.linalg.inv(lower))
    out = np.zeros_like(lower)
    first = out[:half, :half] = _inverse(lower[:half, :half])
    last = out[half:, half:] = _inverse(lower[half:, half:])
    out[half:, :half] = -last @ (lower[half:, :half] @ first)
    return out


def spread(left: Array) -> float:
    """Standard deviation per axis from the median of squared lengths, which outliers do not move."""
    square = np.einsum("kd,kd->k", left, left)
    some = square[square > 0]
    return math.sqrt(median(some) / float(scipy.special.chdtri(left.shape[1], 0.5))) if len(some) else EPS
