"""Rows whose errors are correlated, such as the corners of a marker that come from one fit of its pixels.

    r' = S P^-1/2 S^-1 r,   C = S P S

S has the standard deviations, P the correlations. The numbers r' have the same standard deviations and no correlation, and of all such
numbers they are nearest to r: row i of r' is still told by row i of r. Source: Kessy, Lewin and Strimmer, Optimal whitening and
decorrelation, The American Statistician 72 (2018), ZCA-cor.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import field, record
from robocal._types import Array, Bools, Ints

__all__ = ["COVARIANCES", "SQUARE_CORNER", "Decorrelation", "RowCorrelations", "block_of_rows"]

COVARIANCES, SQUARE_CORNER = "covariances", "square and corner"  # columns of `Observations.extra`
KEPT = 8  # of them
LEAST = 1e-5  # tolerance: of an eigenvalue of correlations: files round to six digits


@record(eq=False)
class RowCorrelations:
    """Rows edges[b] to edges[b + 1] are block b; covariance (m, 2, 8) is that of the numbers of a row with the numbers of every corner
    of its block, corner (m,) says which is its own; sigma (m, 2) are the standard deviations that belong to it. What is added to these
    later is independent."""

    edges: Ints
    covariance: Array
    corner: Ints
    sigma: Array
    # What was worked out last, by which rows are used and their noise: fits go to and fro between few of these.
    memo: dict[tuple[bytes, bytes], Decorrelation] = field(default_factory=dict, repr=False)

    def decorrelate(self, used: Bools, sigma: Array) -> Decorrelation:
        """What takes the correlations from the rows that are used (m,), of standard deviations sigma (m, 2)."""
        key = used.tobytes(), sigma.tobytes()
        if key not in self.memo:
            while len(self.memo) >= KEPT:
                del self.memo[next(iter(self.memo))]
            self.memo[key] = self._decorrelate(used, sigma)
        return self.memo[key]

    def _decorrelate(self, used: Bools, sigma: Array) -> Decorrelation:
        rows, many = np.flatnonzero(used), len(self.edges) - 1
        block = np.repeat(np.arange(many), np.diff(self.edges))
        mine = block[rows]
        count = np.bincount(mine, minlength=many)
        first = np.cumsum(count) - count
        mixing = np.tile(np.eye(8), (many, 1, 1))
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
            mixing[count == h, : 2 * h, : 2 * h] = s[:, :, None] * root / s[:, None]
        return Decorrelation(self.edges, block, used, mixing)


@record(eq=False)
class Decorrelation:
    """Matrices (U, 8, 8) for the blocks of rows, block (m,), whose rows are the used ones of a block in their order; other rows stay as
    they are."""

    edges: Ints
    block: Ints
    used: Bools
    mixing: Array

    def whole_blocks(self, first: int, rows: int) -> tuple[int, int]:
        """The rows, first and behind the last, of all blocks that some rows belong to."""
        return int(self.edges[self.block[first]]), int(self.edges[self.block[first + rows - 1] + 1])

    def mix(self, values: Array, first: int) -> Array:
        """Numbers (B, n, 2, k) of whole blocks, from the row `first` on, made independent, in place."""
        from robocal.measure.sights.blocks._kernels import mix_rows

        if values.size:
            mix_rows(values, first, self.used, self.block, self.mixing)
        return values

    @staticmethod
    def join(some: Sequence[Decorrelation], order: Ints) -> Decorrelation:
        """Those of rows one after the other, in another order that leaves blocks whole."""
        starts = np.cumsum([0, *(len(d.mixing) for d in some[:-1])])
        block = np.concatenate([d.block + start for d, start in zip(some, starts, strict=True)])[order]
        used = np.concatenate([d.used for d in some])[order]
        edges = np.flatnonzero(np.append(True, np.append(np.diff(block) != 0, True)))
        return Decorrelation(edges, block, used, np.concatenate([d.mixing for d in some]))


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
