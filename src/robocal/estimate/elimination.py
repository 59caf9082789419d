"""What the rows of a problem say of its shared columns, local blocks projected out."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Bools, Ints
from robocal.estimate.problem import Problem
from robocal.estimate.sparse_rows import ROWS, blocks_of
from robocal.estimate.terms import Linear

__all__ = [
    "Squares", "beside_blocks", "beside_each", "block_columns", "block_ranks", "eliminate", "reducible", "reweight", "spare_numbers",
    "squares", "triangle",
]  # fmt: skip

# Exactly dependent to first order, in units of the largest singular value of a block.
MANY = 4  # grid: times as many rows as columns of a block: whose whole square basis costs more than it saves
STRUCTURAL = 1e-9
RESOLUTION = 1e-13  # of a triangle of rows; half as many digits where it comes from normal equations
SQUARED = 3e-7
TOGETHER = 1 << 18  # grid: numbers of a Jacobian that are copied at once
DENSE = 4_000_000  # numbers of a Jacobian beyond which it is not formed where local blocks can be eliminated


@record
class Squares:
    """What the rows of a problem say of some columns at one x: R (n, n) with R^T R = J^T J, the sum of squared residuals, how
    many numbers that is, and how many of them local blocks take; robust weights applied."""

    names: tuple[str, ...]
    root: Array
    square: float
    rows: int
    taken: int = 0
    resolution: float = RESOLUTION  # singular values below this share of the largest are rounding

    def of(self, names: tuple[str, ...]) -> Array:
        """R of some of the columns."""
        return self.root if names == self.names else triangle(self.root[:, [self.names.index(n) for n in names]])


def squares(problem: Problem, x: Array, lin: Linear | None = None) -> Squares:
    """Of the free columns at x (1, P); `lin` is the problem linearised there, where the caller has it."""
    if lin is None and reducible(problem):
        return _reduce(problem, x)
    lin = reweight(problem.linearize(x) if lin is None else lin, problem)
    taken = block_columns(lin)
    root = triangle(eliminate(lin))
    return Squares(problem.free, root, float(lin.r @ lin.r), len(lin.r), taken)


def reducible(problem: Problem) -> bool:
    """Whether local blocks are eliminated from the normal equations: with two families, and where a Jacobian would be large."""
    return problem.sizes[1][1] > 0 or (problem.blocks > 0 and int(problem.numbers.sum()) * problem.n > DENSE)


def _reduce(problem: Problem, x: Array) -> Squares:
    from robocal.estimate.schur.system import information

    normal = replace(problem, priors=False).normal(np.atleast_2d(x))
    root, rank = information(normal, problem.scales, problem.sizes, problem.pairs)
    weight = problem.first_weight
    square, rows = 0.0, 0
    for r in problem.residuals(x):
        counts = r.used & (weight[r.configuration] > 0)
        white = r.white[counts]
        each = np.sum(white**2, axis=1)
        slope = problem.slope(each, r.reading)
        square += float(weight[r.configuration[counts]] @ (slope**2 * each))
        rows += white.size
    held = sum(int((f.prior.root != 0).any(axis=2).sum()) for f in problem.families if f.prior is not None)
    return Squares(problem.free, root, square, rows, rank - held, SQUARED)


def reweight(lin: Linear, problem: Problem) -> Linear:
    """Columns times the root of the robust weight, residuals times the weight: what the fit set aside neither informs
    nor enlarges."""
    if problem.loss == "none" or not len(lin.r):
        return lin
    weight = problem.slopes(lin.r**2, lin)
    root = np.sqrt(weight)[:, None]
    # chi2 counts what pulls, the influence: a gross row pulls no harder than its loss allows.
    return replace(lin, r=weight * lin.r, j=root * lin.j, jl=root * lin.jl, jm=root * lin.jm)


def eliminate(lin: Linear) -> Array:
    """J (N', n) with local blocks projected out: rows of Q2^T J, where Q2 spans what the blocks' columns, their priors
    included, leave free."""
    if not lin.jl.shape[1] or (lin.local < 0).all():
        return lin.j if not lin.jm.shape[1] else _beside_second(lin, lin.jm, lin.j)
    wide = lin.jm.shape[1]
    both = np.hstack([lin.jm, lin.j]) if wide else lin.j
    parts = [both[lin.local < 0]]
    for _, rows, jl in _blocks(lin):
        if jl.shape[1] == rows.shape[1] >= MANY * jl.shape[2]:
            parts.append(_beside(jl, both[rows]))
            continue
        u, s, _ = np.linalg.svd(jl, full_matrices=True)
        spans = np.zeros(jl.shape[:2], dtype=bool)
        spans[:, : s.shape[1]] = _spans(s)
        # Nothing shared is in the rows of a prior.
        left = np.swapaxes(u[:, : rows.shape[1]], 1, 2) @ both[rows]
        parts.append(left[~spans])
    left = np.concatenate(parts)
    return _beside_second(lin, left[:, :wide], left[:, wide:]) if wide else left


def _beside(jl: Array, j: Array) -> Array:
    """(I - U U^T) J as rows, of blocks (b, k, l) with many rows and no prior, and J (b, k, n): as much as Q2^T J, without its square."""
    u, s, _ = np.linalg.svd(jl, full_matrices=False)
    own = u * _spans(s)[:, None, :]
    for _ in range(2):
        j = j - own @ (np.swapaxes(own, 1, 2) @ j)
    return np.asarray(j.reshape(len(j) * j.shape[1], j.shape[2]))


def _beside_second(lin: Linear, jm: Array, j: Array) -> Array:
    """What the blocks of the second family leave of j (N, n); jm (N, M q) is what those of the first have left of theirs."""
    if lin.keep is not None:
        jm, j = np.vstack([jm, lin.keep]), np.vstack([j, np.zeros((len(lin.keep), j.shape[1]))])
    own = _second(lin, jm)
    for _ in range(2):
        j = j - own @ (own.T @ j)
    return np.asarray(j)


def _second(lin: Linear, jm: Array) -> Array:
    """An orthonormal basis of the columns of the second family's blocks, (N, rank): what the first has left of a column counts
    against what the column was."""
    u, s, _ = np.linalg.svd(jm, full_matrices=False)
    return np.asarray(u[:, s > STRUCTURAL * np.linalg.norm(lin.jm, axis=0).max(initial=0.0)])


def block_columns(lin: Linear) -> int:
    """What local blocks cost in degrees of freedom: their own ranks, less what their priors bring in as rows."""
    rank = 0
    for _, rows, jl in _blocks(lin):
        rank += int(_spans(np.asarray(np.linalg.svd(jl, compute_uv=False))).sum())
        rank -= int((jl[:, rows.shape[1] :] != 0).any(axis=2).sum())
    if lin.jm.shape[1]:
        beside = eliminate(replace(lin, j=lin.jm, jm=lin.jm[:, :0]))
        rank += _second(lin, triangle(beside if lin.keep is None else np.vstack([beside, lin.keep]))).shape[1]
        rank -= 0 if lin.keep is None else int((lin.keep != 0).any(axis=1).sum())
    return rank


def block_ranks(lin: Linear, blocks: int) -> Ints:
    """How many of its own columns the rows of each block of the first family determine, (blocks,)."""
    out = np.zeros(blocks, dtype=np.int64)
    for own, rows, jl in _blocks(lin):
        out[own] = _spans(np.asarray(np.linalg.svd(jl[:, : rows.shape[1]], compute_uv=False))).sum(axis=1)
    return out


def spare_numbers(problem: Problem, x: Array) -> Ints:
    """How many numbers each configuration leaves beyond those that its own pose takes, (U,): as many as the pose's columns have ranks.
    Where no Jacobian is formed, every number of a pose counts as determined."""
    poses = next((f for f in problem.families[:1] if f.count == problem.configurations), None)
    if poses is None or reducible(problem):
        return np.maximum(problem.numbers - (0 if poses is None else poses.size), 0)
    return problem.numbers - block_ranks(problem.with_free(()).linearize(x), poses.count)


def beside_blocks(lin: Linear) -> tuple[Array, Array]:
    """How much of every row its local blocks take for themselves, (N,): |row of U1|^2, where U1 spans the blocks' columns; and M J
    (N, n) with M = I - U1 U1^T, what is left for shared columns. The first is `block_columns` in all where blocks have no
    priors, and less by what the priors hold otherwise."""
    wide = lin.jm.shape[1]
    taken, whole = np.zeros(len(lin.r)), np.hstack([lin.jm, lin.j]) if wide else lin.j
    left = whole
    if lin.jl.shape[1]:
        left, alone = np.empty_like(whole), lin.local < 0
        if alone.any():
            left[alone] = whole[alone]
    for rows, own, mine in beside_each(lin, whole):
        taken[rows], left[rows] = np.sum(own**2, axis=2), mine
    if wide:
        second, left = left[:, :wide], left[:, wide:]
        own = _second(lin, second if lin.keep is None else np.vstack([second, lin.keep]))[: len(second)]
        taken += np.sum(own**2, axis=1)
        left = left - own @ (own.T @ left)
    return taken, left


def beside_each(lin: Linear, whole: Array) -> Iterator[tuple[Ints, Array, Array]]:
    """Of the first family's blocks, some at a time: their rows (b, k), U1 (b, k, l), and what they leave of these rows of `whole` (N, n),
    (b, k, n). What is made at once stays in the cache."""
    for _, rows, jl in _blocks(lin):
        u, s, _ = np.linalg.svd(jl, full_matrices=False)
        basis = (u * _spans(s)[:, None, :])[:, : rows.shape[1]]
        step = max(1, TOGETHER // max(rows.shape[1] * whole.shape[1], 1))
        for first in range(0, len(rows), step):
            at, own = rows[first : first + step], basis[first : first + step]
            mine = whole[at]
            mine -= own @ (np.swapaxes(own, 1, 2) @ mine)
            yield at, own, mine


def _spans(s: Array) -> Bools:
    """Which singular values (b, k) of blocks are any: one that its rows do not determine takes away only what they say of it."""
    return np.asarray(s > STRUCTURAL * s.max(axis=1, keepdims=True, initial=0.0))


def _blocks(lin: Linear) -> Iterator[tuple[Ints, Ints, Array]]:
    """Blocks of the first family with the same number of rows together: which blocks (b,), which rows (b, k), and their columns
    (b, k or k + l, l), the rows of the blocks' priors last."""
    inside = lin.local >= 0
    if not lin.jl.shape[1] or not inside.any():
        return
    blocks, counts = np.unique(lin.local[inside], return_counts=True)
    order = np.argsort(lin.local, kind="stable")
    order = order[inside[order]]
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    for count in np.unique(counts):
        rows = order[starts[counts == count][:, None] + np.arange(count)]
        own, jl = blocks[counts == count], lin.jl[rows]
        yield own, rows, jl if lin.hold is None else np.concatenate([jl, lin.hold[own]], axis=1)


def triangle(j: Array, chunk: int = 2000) -> Array:
    """R (n, n) with R^T R = J^T J, by QR in chunks of rows: rank decisions are taken on R, never on J^T J."""
    j = _shorten(j)
    r: Array = np.zeros((0, j.shape[1]))
    for first in range(0, max(len(j), 1), chunk):
        r = np.asarray(np.linalg.qr(np.vstack([r, j[first : first + chunk]]), mode="r"))
    if len(r) < j.shape[1]:
        r = np.vstack([r, np.zeros((j.shape[1] - len(r), j.shape[1]))])
    return r


def _shorten(j: Array) -> Array:
    """Fewer rows that say the same: those of rows that lie together and touch few of the columns, as each of many cameras does."""
    if len(j) < 2 * ROWS or j[:: len(j) // 8].all():
        return j
    parts, shorter = [], False
    for at, felt in blocks_of(j):
        rows = j[at]
        if not isinstance(felt, slice) and 2 * len(felt) < len(rows):
            short, shorter = np.zeros((len(felt), j.shape[1])), True
            short[:, felt] = np.linalg.qr(rows[:, felt], mode="r")
            rows = short
        parts.append(rows)
    return np.concatenate(parts) if shorter else j
