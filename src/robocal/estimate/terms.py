"""What a problem is made of, and what it hands to solvers: terms, normal equations, residuals, and the dense linearisation of terms as
whitened residuals and Jacobians, row by row (`whiten_rows`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cache
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from robocal._record import record
from robocal._types import Array, Bools, Ints
from robocal.estimate.families import Family
from robocal.estimate.losses import Loss

__all__ = ["Linear", "Normal", "ProblemTerm", "Residuals", "Sizes", "pieces", "spread", "whiten_rows"]

Sizes = tuple[tuple[int, int], tuple[int, int]]  # blocks and columns of a block, of the first and of the second family


class ProblemTerm(Protocol):
    """Rows of one kind: residual (value predicted minus measured) and Jacobian, not yet whitened."""

    @property
    def group(self) -> str:
        """The sensor group that the rows belong to, for chi2."""

    @property
    def kind(self) -> str:
        """The kind of measurement."""

    @property
    def parts(self) -> tuple[tuple[int, int, str], ...]:
        """Columns that share a unit: start, stop, SI unit."""

    @property
    def scale(self) -> Array:
        """1 / sigma, shape (m, d); zero where a row is set aside."""

    @property
    def configuration(self) -> Ints:
        """The configuration of each row, shape (m,): what is held out together."""

    @property
    def local(self) -> tuple[Ints, Ints]:
        """The block of the first and of the second family that each row touches, (m,) each, or -1."""

    @property
    def touches(self) -> tuple[bool, bool]:
        """Whether any row touches a block of the first, of the second family."""

    @property
    def pairs(self) -> Ints:
        """The pairs of blocks of both families that rows touch, (K, 2)."""

    @property
    def pair(self) -> Ints:
        """Which of them each row touches, (m,), or -1."""

    @property
    def lever(self) -> Array | None:
        """What turns all columns into one error, (m, d); see `Residuals`."""

    @property
    def used(self) -> Bools:
        """Whether each row counts, (m,); the scale of one that is set aside is zero."""

    @property
    def reading(self) -> bool:
        """Whether the rows read the machine; constraints do not, and no loss weighs them down."""

    @property
    def columns(self) -> Ints:
        """The tangent column of each Jacobian column, shape (k,)."""

    @property
    def view(self) -> object:
        """What several terms look through, whose normal equations are summed as one; None of most."""

    def join(self, some: Any) -> ProblemTerm:
        """Terms of one view, this among them, as one for normal equations."""

    @property
    def plain(self) -> ProblemTerm:
        """The same rows as they were read; itself, where no errors of rows are correlated."""

    def bind(self, column_of: Ints) -> ProblemTerm:
        """The same rows with Jacobian columns for the table rows where column_of (P,) >= 0."""

    def without(self, rows: Bools) -> ProblemTerm:
        """The same term with these rows (m,) set aside."""

    def hold(self, family: int) -> ProblemTerm:
        """The same rows, where the local blocks of a family (0 or 1) stay where x has them."""

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        """r (B, m, d), J (B, m, d, k), J of the local blocks (B, m, d, l), those of the first family before those of the second
        (none of a family that no row touches); `which` (B,) says which problems of the batch these are."""

    def accumulate(self, x: Array, which: Ints, weight: Array, loss: Loss, pair: int, out: Normal) -> bool:
        """Adds its rows to the normal equations by itself, where it has a shorter way than through `evaluate`, and says whether it
        did; weight (1 or B, U), `pair`: where its pairs begin in `Normal.cross`."""


@dataclass
class Normal:
    """Half the weighted sum of squares, its gradient and Gauss-Newton matrix, local blocks kept apart: those of the first family
    in gl, al, asl, of the second in gm, am, asm, and between them in `cross`, for the pairs that rows touch (lower triangles)."""

    cost: Array  # (B,)
    g: Array  # (B, n)
    a: Array  # (B, n, n)
    gl: Array  # (B, L, l)
    al: Array  # (B, L, l, l)
    asl: Array  # (B, L, n, l)
    gm: Array  # (B, M, q)
    am: Array  # (B, M, q, q)
    asm: Array  # (B, M, n, q)
    cross: Array  # (B, K, l, q)

    @classmethod
    def zeros(cls, batch: int, n: int, first: tuple[int, int], second: tuple[int, int], pairs: int) -> Normal:
        """Nothing yet, for families of so many blocks of so many columns."""
        (many, l), (more, q) = first, second
        cost, g, a = np.zeros(batch), np.zeros((batch, n)), np.zeros((batch, n, n))
        if not many and not more:  # the small problems, where every call counts
            return cls(cost, g, a, *_nothing(batch))
        shapes = [(many, l), (many, l, l), (many, n, l), (more, q), (more, q, q), (more, n, q), (pairs, l, q)]
        return cls(cost, g, a, *(np.zeros((batch, *shape)) for shape in shapes))

    def nothing(self, batch: int) -> Normal:
        """Nothing yet of the same blocks, for so many problems."""
        return Normal(*(np.zeros((batch, *getattr(self, name).shape[1:])) for name in _NAMES))

    def add(self, other: Normal, times: float) -> None:
        """Adds so many times those of other rows; what one problem says is said to all."""
        for name in _NAMES:
            mine = getattr(self, name)
            mine += times * getattr(other, name)

    def of_family(self, second: int) -> tuple[Array, Array, Array]:
        """Gradient, matrix and what it shares with the free columns, of the first (0) or second (1) family."""
        return (self.gm, self.am, self.asm) if second else (self.gl, self.al, self.asl)

    def take(self, index: Ints | slice) -> Normal:
        """The same for a subset of the batch; of a slice a view."""
        return Normal(*(getattr(self, name)[index] for name in _NAMES))

    @staticmethod
    def concatenate(parts: Sequence[Normal]) -> Normal:
        """The normal equations of parts of a batch as one."""
        return Normal(*(np.concatenate([getattr(part, name) for part in parts]) for name in _NAMES))

    def put(self, index: Ints, other: Normal) -> None:
        """Overwrites a subset of the batch."""
        for name in _NAMES:
            getattr(self, name)[index] = getattr(other, name)


_NAMES = tuple(f.name for f in fields(Normal))


@cache
def _nothing(batch: int) -> tuple[Array, ...]:
    flat, square = np.empty((batch, 0, 0)), np.empty((batch, 0, 0, 0))
    return flat, square, square, flat, square, square, square


@record
class Linear:
    """Whitened residual and dense Jacobian of one problem: r (N,), j (N, n), jl (N, l) of the block `local` (N,) of the first
    family, jm (N, M q) of all blocks of the second, of the rows that count; robust weights are not applied, and concern only what
    is a `reading` of the machine. `hold` (L, l, l) are the rows of the first family's priors, `keep` (H, M q) those of the second's,
    whitened (None: no priors)."""

    r: Array
    j: Array
    jl: Array
    local: Ints
    configuration: Ints
    observation: Ints
    group: Ints
    reading: Bools
    jm: Array
    hold: Array | None = None
    keep: Array | None = None


@record
class Residuals:
    """Unwhitened residuals of one term: values (m, d) or (B, m, d), with its scale, unit, group, kind and parts, and
    which rows count, `used` (m,).

    lever (m, d) turns the columns of a row into one error in the unit of the first part (a range and the arcs of its
    angles); None where the first part alone is that error. `independent` are numbers with the same standard deviations and without
    the correlations that are stated; None where none is.
    """

    value: Array
    scale: Array
    configuration: Ints
    group: str
    kind: str
    parts: tuple[tuple[int, int, str], ...]
    used: Bools
    lever: Array | None = None
    reading: bool = True
    independent: Array | None = None

    @property
    def white(self) -> Array:
        """Independent numbers in units of their noise, (m, d) or (B, m, d)."""
        return (self.value if self.independent is None else self.independent) * self.scale

    def length(self, part: int = 0) -> Array:
        """Length of the error of every row in one part's unit, (m,) or (B, m)."""
        start, stop, _ = self.parts[part]
        value = self.value[..., start:stop] if part or self.lever is None else self.value * self.lever
        return np.asarray(np.linalg.norm(value, axis=-1))


def spread(narrow: Array, columns: Ints, n: int, out: Array | None = None) -> Array:
    """The Jacobian of a term (m, d, k) over all n columns: the k-th feeds columns[k], and two may feed one. `out` (m, d, n), of zeros,
    takes it where that is told."""
    if len(columns) == n and (columns == np.arange(n)).all():
        if out is not None:
            out[:] = narrow
        return narrow
    out = np.zeros((*narrow.shape[:2], n)) if out is None else out
    if len(set(columns.tolist())) < len(columns):
        for i, column in enumerate(columns):
            out[..., column] += narrow[..., i]
        return out
    # Columns that lie together are written together.
    ends = np.flatnonzero(np.append(True, np.append(np.diff(columns) != 1, True))).tolist()
    for lo, hi in pairwise(ends if len(columns) else ()):
        out[..., columns[lo] : columns[lo] + hi - lo] = narrow[..., lo:hi]
    return out


def pieces(term: ProblemTerm, batch: int, local: int, most: int) -> list[tuple[int, int, int, int]]:
    """Slices of batch and rows (lo, hi, first, rows) whose Jacobian, with `local` columns of blocks, has at most so many numbers."""
    m, d = term.scale.shape
    each = max(1, d * (len(term.columns) + local))
    if batch * m * each <= most:
        return [(0, batch, 0, m)]
    rows = max(1, min(m, most // each))
    many = max(1, most // (each * rows)) if rows == m else 1
    return [
        (lo, min(batch, lo + many), first, min(rows, m - first))
        for lo in range(0, batch, many)
        for first in range(0, m, rows)
    ]


HERE = np.zeros(1, dtype=np.int64)
ROWS = 1 << 18  # numbers of a Jacobian that are made at once


def whiten_rows(
    terms: Sequence[ProblemTerm], x: Array, n: int, families: Sequence[Family], blocks: Sequence[Array], weight: Array, chosen: Bools
) -> Linear:  # fmt: skip
    """The rows of bound terms at x (1, P) that count, of the chosen configurations (U,), each with the root of its weight (U,);
    `blocks` are the values of each family's blocks (1, L, w)."""
    groups = sorted({t.group for t in terms})
    size, extra = ([*(f.size for f in families), 0, 0])[:2]
    many = families[1].count if extra else 0
    keeps = [chosen[t.configuration] & t.used for t in terms]
    whole = sum(int(keep.sum()) * t.scale.shape[1] for t, keep in zip(terms, keeps, strict=True))
    # Of many rows every copy of the Jacobian costs as much as the Jacobian: it is made where it stays, some rows at a time.
    r, j, jl, jm = np.empty(whole), np.zeros((whole, n)), np.zeros((whole, size)), np.zeros((whole, many * extra))
    of_rows, group, reading = (
        np.empty((3, whole), dtype=np.int64),
        np.empty(whole, dtype=np.int64),
        np.empty(whole, bool),
    )
    end, count = 0, 0
    for term, keep in zip(terms, keeps, strict=True):
        m, d = term.scale.shape
        step = max(1, ROWS // (d * (len(term.columns) + size + extra + 1)))
        for first in range(0, m, step):
            inside = keep[first : first + step]
            some = int(inside.sum())
            if not some:
                continue
            value, jac, jloc = term.evaluate(x, HERE, first, len(inside))
            at, rows = slice(end, end + some * d), first + np.flatnonzero(inside)
            scale = term.scale[rows] * np.sqrt(weight[term.configuration[rows]])[:, None]
            value, jac, jloc = ((v[0] if some == len(inside) else v[0][inside]) for v in (value, jac, jloc))
            np.multiply(value, scale, out=r[at].reshape(some, d))
            jac *= scale[..., None]
            spread(jac, term.columns, n, j[at].reshape(some, d, n))
            one, two = (block[rows] for block in term.local)
            cut = jloc.shape[2] - extra if term.touches[1] else jloc.shape[2]
            if cut:
                jl[at].reshape(some, d, size)[:] = jloc[..., :cut] * scale[..., None]
            met = np.flatnonzero(two >= 0)
            if len(met):
                second = jm[at].reshape(some, d, many, extra)
                second[met, :, two[met]] = (jloc[..., cut:] * scale[..., None])[met]
            of_rows[:, at] = np.repeat([one, term.configuration[rows], np.arange(count, count + some)], d, axis=1)
            group[at], reading[at] = groups.index(term.group), term.reading
            end, count = end + some * d, count + some
    held = [None if f.prior is None else f.prior.rows(b)[1][0] for f, b in zip(families, blocks, strict=True)]
    hold, own = ([*held, None, None])[:2]
    one, where, observation = of_rows
    return Linear(r, j, jl, one, where, observation, group, reading, jm, hold, None if own is None else _diagonal(own))


def _diagonal(blocks: Array) -> Array:
    """Blocks (M, q, q) on the diagonal of one matrix."""
    many, size, _ = blocks.shape
    out = np.zeros((many, size, many, size))
    out[np.arange(many), :, np.arange(many)] = blocks
    return out.reshape(many * size, many * size)
