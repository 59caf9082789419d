"""Rows whose errors are correlated, such as the corners of a marker that come from one fit of its pixels.

    r' = S P^-1/2 S^-1 r,   C = S P S

S has the standard deviations, P the correlations. The numbers r' have the same standard deviations and no correlation, and of all such
numbers they are nearest to r: row i of r' is still told by row i of r. Source: Kessy, Lewin and Strimmer, Optimal whitening and
decorrelation, The American Statistician 72 (2018), ZCA-cor.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import record
from robocal._types import Array, Bools, Ints

__all__ = ["COVARIANCES", "SQUARE_CORNER", "Decorrelation", "RowCorrelations", "block_of_rows"]

COVARIANCES, SQUARE_CORNER = "covariances", "square and corner"  # columns of `Observations.extra`
LEAST = 1e-5  # tolerance: of an eigenvalue of correlations: files round to six digits


@record(eq=False)
class RowCorrelations:
    """Rows edges[b] to edges[b + 1] are block b; covariance (m, 2, 8) is that of the numbers of a row with the numbers of every corner of its
    block, corner (m,) says which is its own; sigma (m, 2) are the standard deviations that belong to it. What is added to these later is
    independent."""

    edges: Ints
    covariance: Array
    corner: Ints
    sigma: Array

    def decorrelate(self, used: Bools, sigma: Array) -> Decorrelation:
        """What takes the correlations from the rows that are used (m,), of standard deviations sigma (m, 2)."""
        rows = np.flatnonzero(used)
        block = np.searchsorted(self.edges, rows, side="right") - 1
        count = np.bincount(block, minlength=len(self.edges) - 1)
        first = np.cumsum(count) - count
        parts = []
        for h in np.unique(count[count > 0]).tolist():
            order = rows[first[count == h][:, None] + np.arange(h)]
            at = 2 * self.corner[order][:, :, None] + np.arange(2)
            p = np.take_along_axis(self.covariance[order], at.reshape(len(order), 1, 1, 2 * h), axis=3)
            p = p.reshape(len(order), 2 * h, 2 * h)
            s, share = ((v[order].reshape(len(order), 2 * h)) for v in (sigma, np.minimum(self.sigma / sigma, 1.0)))
            p = (p + p.transpose(0, 2, 1)) / 2 * (share / s)[:, :, None] * (share / s)[:, None]
            np.einsum("uii->ui", p)[:] = 1.0
            values, vectors = np.linalg.eigh(p)
            root = (vectors / np.sqrt(np.maximum(values, LEAST))[:, None]) @ vectors.transpose(0, 2, 1)
            parts.append((order, s[:, :, None] * root / s[:, None]))
        return Decorrelation(self.edges, tuple(parts))


@record(eq=False)
class Decorrelation:
    """Matrices (U, 2 h, 2 h) for rows (U, h), by their count h; other rows stay as they are."""

    edges: Ints
    parts: Sequence[tuple[Ints, Array]]

    def whole_blocks(self, first: int, rows: int) -> tuple[int, int]:
        """The rows, first and behind the last, of all blocks that some rows belong to."""
        lo = np.searchsorted(self.edges, first, side="right") - 1
        hi = np.searchsorted(self.edges, first + rows, side="left")
        return int(self.edges[lo]), int(self.edges[hi])

    def mix(self, values: Array, first: int) -> Array:
        """Numbers (B, n, 2, k) of whole blocks, from the row `first` on, made independent."""
        batch, n, _, k = values.shape
        out = values.copy()
        for order, matrix in self.parts:
            lo, hi = np.searchsorted(order[:, 0], [first, first + n])
            some = order[lo:hi] - first
            if len(some):
                seen = values[:, some].reshape(batch, len(some), 2 * some.shape[1], k)
                out[:, some] = (matrix[lo:hi] @ seen).reshape(batch, *some.shape, 2, k)
        return out


def block_of_rows(square: Array, *groups: Ints) -> Ints:
    """Which block each of some rows is of, (m,): those of one square in one view, square (m, 2) with the corner. Where a corner is there
    twice, each of its rows is alone."""
    keys = np.column_stack([*groups, square[:, 0].astype(np.int64)])
    _, block = np.unique(keys, axis=0, return_inverse=True)
    block = block.ravel()
    _, where, many = np.unique(4 * block + square[:, 1].astype(np.int64), return_inverse=True, return_counts=True)
    twice = np.bincount(block, many[where.ravel()] > 1) > 0
    alone = twice[block]
    return np.asarray(np.where(alone, block.max(initial=0) + 1 + np.arange(len(block)), block), dtype=np.int64)
