"""Free columns in groups that no row sees two of, as markers of a map are: eliminated group by group, like local blocks.

    [A_g  B  ] [g]     [b_g]
    [B^T  A_r] [r] = - [b_r],    A_g block diagonal over the groups g, r all other columns and the local blocks

Whether columns share a row is asked of the terms and of the priors, never of numbers that happen to be zero. It is the elimination of
`system.py` with the groups in place of a family. Source: O'Leary and Stewart, Computing the eigenvalues and eigenvectors of symmetric
arrowhead matrices (1990), for the shape.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.estimate.problem import Problem
from robocal.estimate.schur.system import System, structure, work
from robocal.estimate.terms import Normal

__all__ = ["Arrowhead", "system_of"]

WORTH = 0.6  # grid: of the operations: where groups save less, gathering them costs as much
NONE = np.zeros((0, 0), dtype=np.int64)


class Arrowhead:
    """The system of n free columns, groups (E, s) of which are eliminated, and of one family of local blocks, (blocks, columns), that
    meet in pairs (K, 2) of group and block."""

    def __init__(self, n: int, groups: Ints, family: tuple[int, int], pairs: Ints) -> None:
        self.groups, self.pairs = groups, pairs
        rest = self.rest = np.setdiff1d(np.arange(n), groups)
        self.system = System(0, len(rest), (groups.shape, family), pairs)
        # Of symmetric matrices the lower triangle is there.
        self.own = _lower(groups[:, :, None], groups[:, None, :], n)
        self.between = _lower(rest[:, None], groups[:, None, :], n)
        self.left = _lower(rest[:, None], rest, n)
        self.met = groups[pairs[:, 0]]

    def solve(
        self, normal: Normal, b: int, lam: float, damp: Array, local: tuple[Array, Array], held: Bools,
        step: Array, steps: tuple[Array, Array],
    ) -> bool:  # fmt: skip
        """As `System.solve`: the step (n,) and those of the blocks, of one problem of a batch under damping."""
        groups, rest = self.groups, self.rest
        a, g, shared = normal.a[b].ravel(), normal.g[b], normal.asl[b]
        if not shared.size:  # without blocks it has no columns at all
            shared = np.empty((self.system.retained[0], len(g), 0))
        parted = Normal(
            normal.cost[b : b + 1], g[rest][None], a[self.left][None], g[groups][None], a[self.own][None], a[self.between][None],
            normal.gl[b : b + 1], normal.al[b : b + 1], np.ascontiguousarray(shared[:, rest])[None],
            shared[self.pairs[:, 1, None], self.met][None],
        )  # fmt: skip
        kept, out = np.empty(len(rest)), np.empty(groups.shape)
        if not self.system.solve(
            parted, 0, lam, damp[rest], (damp[groups], local[0]), held[rest], kept, (out, steps[0])
        ):
            return False
        step[rest], step[groups] = kept, out
        return True


def system_of(problem: Problem) -> System | Arrowhead:
    """How the normal equations of a problem are solved with fewest operations."""
    plain, second = (problem.n, problem.sizes, problem.pairs), problem.sizes[1][1]
    groups = problem.independent if not second else NONE
    if not groups.size:
        return structure(*plain)
    family = problem.sizes[0]
    pairs = _pairs(problem, groups)
    parted = work(0, problem.n - groups.size, (groups.shape, family), pairs)
    if parted > WORTH * min(work(out, *plain) for out in (0, 1) if problem.sizes[out][0] or not out):
        return structure(*plain)
    return Arrowhead(problem.n, groups, family, pairs)


def _pairs(problem: Problem, groups: Ints) -> Ints:
    """The groups and the blocks of the first family that rows have in common, (K, 2)."""
    count, size = problem.sizes[0]
    met = np.zeros((len(groups), count if size else 0), dtype=bool)
    of = np.full(problem.n, -1, dtype=np.int64)
    of[groups] = np.arange(len(groups))[:, None]
    for term in problem.bound_terms if met.size else ():
        block = term.local[0]
        mine, own = of[term.columns], block[block >= 0]
        met[np.ix_(np.unique(mine[mine >= 0]), np.unique(own))] = True
    return np.argwhere(met)


def _lower(row: Ints, column: Ints, n: int) -> Ints:
    """Where the lower triangle of a matrix (n, n), by rows, has them."""
    return np.maximum(row, column) * n + np.minimum(row, column)
