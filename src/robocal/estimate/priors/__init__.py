"""What is known beforehand: priors as further rows, of shared columns; those of local blocks are in `families.py`.

    1/2 |R d|^2 + 1/2 sum_b |R_b e_b|^2,   R^T R = C^-1 of the stated covariance C

d is the tangent step from the table's values to x, e_b that of block b from where it starts. Of a prior that several
parameters share, what it says of the free ones alone counts (their part of C, inverted): a parameter that is held may still
be off, and does not tie down the others. The tangent of a rotation is no vector, so d answers to a further step with the slope
of the rotation vector's left Jacobian, inverted.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array, Ints
from robocal.estimate.terms import Normal
from robocal.parameters import ParameterTable

__all__ = ["PriorTerms", "add_shared", "covariance_root", "shared_root"]


def covariance_root(table: ParameterTable, names: Sequence[str], scales: Array) -> Array:
    """S (n, n) with S S^T the covariance expected without data: `scales` (n,) on the diagonal, and what parameters share where
    all of it is believed."""
    out = np.diag(scales)
    for at, covariance in _shared(table, names):
        if all(table[names[i]].prior_informs for i in at):
            out[np.ix_(at, at)] = np.linalg.cholesky(covariance)
    return out


def shared_root(table: ParameterTable, names: Sequence[str]) -> Array:
    """R (n, n) with R^T R the information of the stated priors of these columns; a row of zeros where none is stated."""
    stated = table.priors[[table.index[n] for n in names]]
    out = np.diag(np.divide(1.0, stated, out=np.zeros(len(stated)), where=stated != 0))
    for at, covariance in _shared(table, names):
        # C = L L^T, so C^-1 = L^-T L^-1.
        out[np.ix_(at, at)] = np.linalg.inv(np.linalg.cholesky(covariance))
    return out


def _shared(table: ParameterTable, names: Sequence[str]) -> list[tuple[Ints, Array]]:
    """Columns and covariance of every prior that at least two of them share."""
    at = {n: i for i, n in enumerate(names)}
    out = []
    for prior in table.together:
        here = [n for n in prior.names if n in at]
        if len(here) > 1:
            out.append((np.array([at[n] for n in here]), prior.of(here)))
    return out


class PriorTerms:
    """What priors of shared columns add, whatever the step, from a root (n, n) and the columns of rotation vectors, (k, 3) or -1: the
    information, whole and in its lower triangle, and the columns (3,) of rotation vectors for which the step is bent."""

    def __init__(self, root: Array, turns: Ints) -> None:
        self.root, self.whole = root, root.T @ root
        self.information = np.tril(self.whole)
        # Alone on their columns and equal on all axes: Jinv^T d = d.
        self.bent = tuple(c for c in turns if (c >= 0).all() and not _even(self.whole, c))


def add_shared(pull: PriorTerms, d: Array, out: Normal) -> None:
    """Adds the priors of shared columns to the normal equations, the matrix in its lower triangle; d (B, n) is the step from their
    means."""
    root = pull.root
    if not pull.bent:
        from robocal.estimate.priors._kernels import add_pull

        add_pull(root, pull.information, d, out.cost, out.g, out.a)
        return
    from robocal.geometry import so3

    along = d @ root.T
    out.cost += 0.5 * np.sum(along * along, axis=1)
    slope = np.broadcast_to(np.eye(len(root)), (len(d), *root.shape)).copy()
    for c in pull.bent:
        slope[:, c[:, None], c] = so3.left_jacobian_inverse(d[:, c])
    rows = root @ slope
    out.g += np.einsum("bij,bi->bj", rows, along)
    out.a += np.tril(np.swapaxes(rows, 1, 2) @ rows)


def _even(info: Array, c: Ints) -> bool:
    """Whether a rotation vector's prior is the same about every axis, and shared with nothing else."""
    own = info[np.ix_(c, c)]
    alone = np.count_nonzero(info[c]) == np.count_nonzero(own)
    return bool(alone and (own == own[0, 0] * np.eye(3)).all())
