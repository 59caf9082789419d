"""What all rows say of the shared columns, local blocks eliminated, without a dense Jacobian.

    S = A - A_l A_ll^-1 A_l^T,    R^T R = S

block by block for one family and then, with two, for the other as a whole. Blocks that their rows do not determine take away only
what the rows say of them. Forming S squares the condition: with columns scaled by their expected errors a singular value is right
to 1e-8 of the largest, which is enough to tell what is seen (1) as long as nothing is known to better than 1e-8 of what was
expected; what is exactly dependent shows below 3e-7 (`BLIND`) of the largest.

The damped normal equations of a problem with two families of local blocks, or with many free columns.

    [A_e  W  ] [e]     [g_e]
    [W^T  A_r] [r] = - [g_r],    S = A_r - W^T A_e^-1 W,    e and r the eliminated and the remaining columns

The family whose elimination costs fewer operations goes block by block, each with the blocks that its rows touch alone. What is
left, the other family and the free columns, goes to LAPACK: as one dense symmetric matrix, or, where few of many blocks are ever
seen together, as a band of blocks with the free columns as its border. References: Triggs et al., Bundle adjustment, a modern
synthesis (2000), section 6; Cuthill and McKee, Reducing the bandwidth of sparse symmetric matrices (1969).
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import as_strided

from robocal import _scipy as scipy
from robocal._types import Array, Bools, Ints
from robocal.estimate.terms import Normal, Sizes

__all__ = ["System", "information", "invert_blocks", "reduced", "structure", "work"]

BLIND = 1e-13  # of the largest eigenvalue of a block with unit diagonal


def reduced(normal: Normal, n: int, sizes: Sizes, pairs: Ints) -> tuple[Array, int]:
    """S (n, n) of the shared columns, with what their priors say where the normal equations of one problem have it, and how many columns of
    local blocks the rows and their priors determine."""
    rank = 0
    whole = np.tril(normal.a[0]) + np.tril(normal.a[0], -1).T
    (many, size), (more, wide) = sizes
    if many and not more:
        half, rank = _halves(normal.al[0])
        y = (half @ np.swapaxes(normal.asl[0], 1, 2)).reshape(many * size, n)
        return whole - y.T @ y, rank
    left = np.zeros((more * wide + n, more * wide + n))
    base = more * wide
    left[base:, base:] = whole
    for b in range(more):
        at = slice(b * wide, (b + 1) * wide)
        left[at, at] = normal.am[0, b]
        left[base:, at] = normal.asm[0, b]
    if many:
        half, rank = _halves(normal.al[0])
        # L^-1 of every block times what it shares with the other family's blocks, then with the free columns.
        order = np.argsort(pairs[:, 0], kind="stable")
        edges = np.searchsorted(pairs[order, 0], np.arange(many + 1))
        shared = np.swapaxes(normal.asl[0], 1, 2)
        for e in range(many):
            own = order[edges[e] : edges[e + 1]]
            met, slot = np.unique(pairs[own, 1], return_inverse=True)
            cross = np.zeros((len(met), size, wide))
            np.add.at(cross, slot, normal.cross[0, own])
            columns = np.concatenate([(met[:, None] * wide + np.arange(wide)).ravel(), base + np.arange(n)])
            y = half[e] @ np.hstack([np.swapaxes(cross, 0, 1).reshape(size, -1), shared[e]])
            met_there = y.any(axis=0)
            columns, y = columns[met_there], y[:, met_there]
            left[columns[:, None], columns] -= y.T @ y
    if more:
        low = np.tril(left) + np.tril(left, -1).T
        half_all, taken = _halves(low[None, :base, :base], np.hstack([np.diag(block) for block in normal.am[0]]))
        y = half_all[0] @ low[:base, base:]
        whole, rank = low[base:, base:] - y.T @ y, rank + taken
    else:
        whole = np.tril(left) + np.tril(left, -1).T
    return whole, rank


def information(normal: Normal, scales: Array, sizes: Sizes, pairs: Ints) -> tuple[Array, int]:
    """R (n, n) with R^T R = S, and how many columns of local blocks the rows and their priors determine, from the normal equations of one
    problem; scales (n,) are the expected errors of the shared columns."""
    n = len(scales)
    whole, rank = reduced(normal, n, sizes, pairs)
    scaled = whole * np.outer(scales, scales)
    values, vectors = np.linalg.eigh(scaled) if n else (np.zeros(0), np.zeros((0, 0)))
    # What is left of a column is rounding of what it was.
    told = values > BLIND * (np.diag(normal.a[0]) * scales**2).max(initial=0.0)
    root = np.where(told, np.sqrt(np.maximum(values, 0.0)), 0.0)[:, None] * vectors.T / scales
    return np.asarray(root[::-1]), rank


def _halves(blocks: Array, before: Array | None = None) -> tuple[Array, int]:
    """H (b, l, l) with H^T H the pseudo-inverses of symmetric blocks, and the sum of their ranks; `before` (l,) is
    the diagonal of a single block before others took from it."""
    length = np.sqrt(np.abs(np.diagonal(blocks, axis1=1, axis2=2) if before is None else before[None]))
    length = np.where(length > 0, length, 1.0)
    values, vectors = np.linalg.eigh(blocks / (length[:, :, None] * length[:, None, :]))
    least = 1.0 if before is not None else 0.0
    known = values > BLIND * np.maximum(values.max(axis=1, keepdims=True, initial=0.0), least)
    root = np.where(known, 1.0 / np.sqrt(np.where(known, values, 1.0)), 0.0)
    return root[:, :, None] * np.swapaxes(vectors, 1, 2) / length[:, None, :], int(known.sum())


def invert_blocks(blocks: Array) -> Array:
    """The pseudo-inverses of symmetric blocks (b, l, l)."""
    half, _ = _halves(blocks)
    return np.asarray(np.swapaxes(half, 1, 2) @ half)


MANY = 1200  # columns of kept blocks from which a band is looked for
NARROW = 0.4  # of them: a wider band costs LAPACK as much as the whole


class System:
    """How the equations of n free columns hang together where one of two families, (blocks, columns of a block) each, is eliminated:
    `out` (0 or 1); its blocks and those of the other meet in pairs (K, 2). See `_kernels.eliminate`."""

    def __init__(self, out: int, n: int, sizes: Sizes, pairs: Ints) -> None:
        (count, size), self.retained = sizes[out], sizes[1 - out]
        self.out, self.n = out, n
        others, wide = self.retained
        base, met = self.base, pairs[:, 1 - out]
        # The order of the kept blocks, where they are a band, and how many columns lie beside its diagonal.
        self.order: Ints | None = None
        self.band = 0
        if base >= MANY:
            order, reach = _band_order(pairs[:, out], met, count, others)
            band = (reach + 1) * wide - 1
            if band < NARROW * base:
                self.order, self.band = order, band
                met = np.argsort(order)[met]
        entries = np.lexsort((met, pairs[:, out]))
        mine, other = pairs[entries, out], met[entries]
        # Entries that meet the same block share a slot: two sensors may see the same pair.
        new = np.ones(len(entries), dtype=bool)
        new[1:] = (mine[1:] != mine[:-1]) | (other[1:] != other[:-1])
        edges = np.arange(count + 1)
        slots_at, entries_at = np.searchsorted(mine[new], edges), np.searchsorted(mine, edges)
        slot = np.cumsum(new) - 1 - slots_at[mine] if len(entries) else np.zeros(0, dtype=np.int64)
        width = np.diff(slots_at) * wide + n
        self.offset = np.concatenate([[0], np.cumsum(size * width)])
        self.start = np.array([slots_at, entries_at], dtype=np.int64)
        self.slots, self.pair, self.slot = (np.ascontiguousarray(v) for v in (other[new], entries, slot))
        system = np.zeros((base, self.band + 1) if self.band else (base + n, base + n))
        border = np.zeros((n, base + n)) if self.band else system[base:]
        room = (np.zeros(shape) for shape in ((base + n,), (count, size, size), (count, size), (int(self.offset[-1]),)))
        # Work space: the system, its border, its right-hand side, what `back` needs.
        self.buffers: tuple[Array, ...] = (system, border, *room)

    @property
    def base(self) -> int:
        """Where the free columns begin."""
        return self.retained[0] * self.retained[1]

    @property
    def size(self) -> int:
        """Columns of what is left."""
        return self.base + self.n

    def solve(
        self, normal: Normal, b: int, lam: float, damp: Array, local: tuple[Array, Array], held: Bools,
        step: Array, steps: tuple[Array, Array],
    ) -> bool:  # fmt: skip
        """The step (n,) and those of the families' blocks, of one problem of a batch under damping; False where the matrix is not
        positive."""
        from robocal.estimate.schur._kernels import back, eliminate, fill, hold

        ge, ae, se = (part[b] for part in normal.of_family(self.out))
        gk, ak, sk = (part[b] for part in normal.of_family(1 - self.out))
        beside = local[1 - self.out]
        if self.order is not None:
            gk, ak, sk, beside = (part[self.order] for part in (gk, ak, sk, beside))
        s, border, v, root, half, store = self.buffers
        s[:] = 0.0
        border[:] = 0.0
        within = self._within(s)
        fill(lam, normal.a[b], normal.g[b], damp, ak, gk, sk, beside, within, border, v)
        if not eliminate(
            lam, self.out == 0, self.base, self.start, self.slots, self.pair, self.slot, self.offset, ge, ae, se, local[self.out],
            normal.cross[b], within, border, v, root, half, store,
        ):  # fmt: skip
            return False
        if held.any():
            hold(held, self.base, border, v)
        if self.size and not (self._solve_band(s, border, v) if self.band else _dense(s, v)):
            return False
        step[:] = v[self.base :]
        kept = v[: self.base].reshape(self.retained)
        steps[1 - self.out][slice(None) if self.order is None else self.order] = kept
        back(self.base, self.start, self.slots, self.offset, root, half, store, self.retained[1], v, steps[self.out])
        return True

    def _within(self, s: Array) -> Array:
        """The rows of the kept blocks as kernels index them: of a band, row i begins where LAPACK keeps column i of the upper
        triangle, and only what lies in the band may be touched."""
        if not self.band:
            return s
        places = s.reshape(-1)[self.band :]
        return as_strided(places, (self.base, self.base), (self.band * s.itemsize, s.itemsize))

    def _solve_band(self, s: Array, border: Array, v: Array) -> bool:
        """Solves with the band for the border and the right-hand side, then for the free columns, into v."""
        base = self.base
        band, info = scipy.lapack.dpbtrf(s.T, lower=0, overwrite_ab=1)
        if info:
            return False
        half, info = scipy.lapack.dpbtrs(band, np.column_stack([border[:, :base].T, v[:base]]), lower=0)
        if info:
            return False
        if self.n:
            rest = border[:, base:] - border[:, :base] @ half[:, :-1]
            _, free, info = scipy.lapack.dposv(rest.T, v[base:] - border[:, :base] @ half[:, -1], lower=0)
            if info:
                return False
            v[base:] = free
        v[:base] = half[:, -1] - half[:, :-1] @ v[base:]
        return True


def _dense(s: Array, v: Array) -> bool:
    """Solves into v."""
    # The lower triangle by rows is the upper one by columns, which LAPACK takes without a copy.
    _, v[:], info = scipy.lapack.dposv(s.T, v, lower=0, overwrite_a=1, overwrite_b=1)
    return not info


def structure(n: int, sizes: Sizes, pairs: Ints) -> System:
    """The system of n free columns and two families, (blocks, columns of a block) each, whose blocks meet in pairs (K, 2)."""
    choices = [(work(out, n, sizes, pairs), out) for out in (0, 1) if sizes[out][0] or not out]
    return System(min(choices)[1], n, sizes, pairs)


def _band_order(mine: Ints, met: Ints, count: int, others: int) -> tuple[Ints, int]:
    """An order of the kept blocks in which those that an eliminated block meets together lie close, and how far apart they are at
    most."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    meets = csr_matrix((np.ones(len(mine)), (mine, met)), shape=(count, others))
    together = (meets.T @ meets).tocsr()
    order = reverse_cuthill_mckee(together, symmetric_mode=True).astype(np.int64)
    rank = np.argsort(order)
    rows, columns = together.nonzero()
    return order, int(np.abs(rank[rows] - rank[columns]).max(initial=0))


def work(out: int, n: int, sizes: Sizes, pairs: Ints) -> float:
    """Operations of one solution, about."""
    (count, size), (others, wide) = sizes[out], sizes[1 - out]
    width = np.bincount(pairs[:, out], minlength=max(count, 1)) * wide + n
    return float(size * np.sum(width.astype(float) ** 2) + (others * wide + n) ** 3 / 3)
