"""The damped normal equations of a problem with two families of local blocks, or with many free columns.

    [A_e  W  ] [e]     [g_e]
    [W^T  A_r] [r] = - [g_r],    S = A_r - W^T A_e^-1 W,    e and r the eliminated and the remaining columns

The family whose elimination costs fewer operations goes block by block, each with the blocks that its rows touch alone; what
is left, the other family and the free columns, goes to LAPACK as one dense symmetric matrix. Reference: Triggs et al., Bundle
adjustment, a modern synthesis (2000), section 6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robocal.estimate.rows import Normal

__all__ = ["System", "structure"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class System:
    """How the equations hang together: which family is eliminated (0 or 1), and which blocks of the other each of its blocks
    meets; see `_kernels.eliminate`."""

    out: int
    n: int
    eliminated: tuple[int, int]  # blocks and columns of a block
    kept: tuple[int, int]
    start: Ints
    slots: Ints
    pair: Ints
    slot: Ints
    offset: Ints
    room: tuple[Array, ...]  # work space: the system, its right-hand side, what `back` needs

    @property
    def base(self) -> int:
        """Where the free columns begin."""
        return self.kept[0] * self.kept[1]

    @property
    def size(self) -> int:
        """Columns of what is left."""
        return self.base + self.n

    def reduced(
        self, normal: Normal, b: int, lam: float, damp: Array, local: tuple[Array, Array]
    ) -> tuple[Array, Array, tuple[Array, Array, Array]] | None:
        """S (N, N), its lower triangle, right-hand side (N,) and what `back` needs, of one problem of a batch under damping; None
        where a block is not positive."""
        from robocal.estimate.schur._kernels import eliminate, fill

        ge, ae, se = (part[b] for part in normal.family(self.out))
        gk, ak, sk = (part[b] for part in normal.family(1 - self.out))
        s, v, root, half, store = self.room
        s[:] = 0.0
        fill(lam, normal.a[b], normal.g[b], damp, ak, gk, sk, local[1 - self.out], s, v)
        good = eliminate(
            lam, self.out == 0, self.base, self.start, self.slots, self.pair, self.slot, self.offset, ge, ae, se, local[self.out],
            normal.cross[b], s, v, root, half, store,
        )  # fmt: skip
        return (s, v, (root, half, store)) if good else None

    def solve(
        self, normal: Normal, b: int, lam: float, damp: Array, local: tuple[Array, Array], held: Bools,
        step: Array, steps: tuple[Array, Array],
    ) -> bool:  # fmt: skip
        """The step (n,) and those of the families' blocks, of one problem of a batch; False where the matrix is not positive."""
        from scipy.linalg.lapack import dposv

        from robocal.estimate.schur._kernels import back, hold

        made = self.reduced(normal, b, lam, damp, local)
        if made is None:
            return False
        s, v, (root, half, store) = made
        if held.any():
            hold(held, self.base, s, v)
        if self.size:
            # The lower triangle by rows is the upper one by columns, which LAPACK takes without a copy.
            _, v, info = dposv(s.T, v, lower=0, overwrite_a=1, overwrite_b=1)
            if info:
                return False
        step[:] = v[self.base :]
        steps[1 - self.out][:] = v[: self.base].reshape(self.kept)
        back(self.base, self.start, self.slots, self.offset, root, half, store, self.kept[1], v, steps[self.out])
        return True


def structure(n: int, sizes: tuple[tuple[int, int], tuple[int, int]], pairs: Ints) -> System:
    """The system of n free columns and two families, (blocks, columns of a block) each, whose blocks meet in pairs (K, 2)."""
    choices = [(_work(out, n, sizes, pairs), out) for out in (0, 1) if sizes[out][0] or not out]
    return _eliminating(min(choices)[1], n, sizes, pairs)


def _eliminating(out: int, n: int, sizes: tuple[tuple[int, int], tuple[int, int]], pairs: Ints) -> System:
    (count, size), (_, wide) = sizes[out], sizes[1 - out]
    order = np.lexsort((pairs[:, 1 - out], pairs[:, out]))
    mine, other = pairs[order, out], pairs[order, 1 - out]
    # Entries that meet the same block share a slot: two sensors may see the same pair.
    new = np.ones(len(order), dtype=bool)
    new[1:] = (mine[1:] != mine[:-1]) | (other[1:] != other[:-1])
    edges = np.arange(count + 1)
    slots_at, entries_at = np.searchsorted(mine[new], edges), np.searchsorted(mine, edges)
    slot = np.cumsum(new) - 1 - slots_at[mine] if len(order) else np.zeros(0, dtype=np.int64)
    width = np.diff(slots_at) * wide + n
    offset = np.concatenate([[0], np.cumsum(size * width)])
    start = np.array([slots_at, entries_at], dtype=np.int64)
    left = sizes[1 - out][0] * wide + n
    room = (left, left), (left,), (count, size, size), (count, size), (int(offset[-1]),)
    return System(
        out, n, sizes[out], sizes[1 - out], start, np.ascontiguousarray(other[new]), np.ascontiguousarray(order),
        np.ascontiguousarray(slot), offset, tuple(np.zeros(shape) for shape in room),
    )  # fmt: skip


def _work(out: int, n: int, sizes: tuple[tuple[int, int], tuple[int, int]], pairs: Ints) -> float:
    """Operations of one solution, about."""
    (count, size), (others, wide) = sizes[out], sizes[1 - out]
    width = np.bincount(pairs[:, out], minlength=max(count, 1)) * wide + n
    return float(size * np.sum(width.astype(float) ** 2) + (others * wide + n) ** 3 / 3)
