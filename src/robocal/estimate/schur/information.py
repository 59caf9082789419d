"""What all rows say of the shared columns, local blocks eliminated, without a dense Jacobian.

    S = A - A_l A_ll^-1 A_l^T,    R^T R = S

block by block for one family and then, with two, for the other as a whole. Blocks that their rows do not determine take away only
what the rows say of them. Forming S squares the condition: with columns scaled by their expected errors a singular value is right
to 1e-8 of the largest, which is enough to tell what is seen (1) as long as nothing is known to better than 1e-8 of what was
expected; what is exactly dependent shows below 3e-7 (`BLIND`) of the largest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robocal._types import Array, Ints
from robocal.estimate.terms import Normal, Sizes

__all__ = ["Information", "information"]

BLIND = 1e-13  # of the largest eigenvalue of a block with unit diagonal


@dataclass(frozen=True)
class Information:
    """R (n, n) of the shared columns, and how many columns of local blocks the rows and their priors determine."""

    root: Array
    rank: int


def information(normal: Normal, scales: Array, sizes: Sizes, pairs: Ints) -> Information:
    """From the normal equations of one problem; scales (n,) are the expected errors of the shared columns."""
    n, rank = len(scales), 0
    whole = np.tril(normal.a[0]) + np.tril(normal.a[0], -1).T
    (many, size), (more, wide) = sizes
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
            left[columns[:, None], columns] -= y.T @ y
    if more:
        low = np.tril(left) + np.tril(left, -1).T
        half_all, taken = _halves(low[None, :base, :base], np.hstack([np.diag(block) for block in normal.am[0]]))
        y = half_all[0] @ low[:base, base:]
        whole, rank = low[base:, base:] - y.T @ y, rank + taken
    else:
        whole = np.tril(left) + np.tril(left, -1).T
    scaled = whole * np.outer(scales, scales)
    values, vectors = np.linalg.eigh(scaled) if n else (np.zeros(0), np.zeros((0, 0)))
    # What is left of a column is rounding of what it was.
    told = values > BLIND * (np.diag(normal.a[0]) * scales**2).max(initial=0.0)
    root = np.where(told, np.sqrt(np.maximum(values, 0.0)), 0.0)[:, None] * vectors.T / scales
    return Information(np.asarray(root[::-1]), rank)


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
