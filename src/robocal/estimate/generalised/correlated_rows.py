"""Rows that share an error per configuration, as one row of many numbers: what a solver sees in place of a local block."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.estimate.losses import Loss
from robocal.estimate.terms import Normal, ProblemTerm

__all__ = ["Correlated"]

WHITE = "1"  # the unit of numbers that were whitened
CHUNK = 1 << 17  # numbers of a Jacobian at once


class Correlated:
    """The numbers (row times d + column) `order` (U, h) of a term, whose residual at the linearisation is `offset` larger (1 or B,
    U, h) and has the information W, `info` (1 or B, U, h, h). Whitened by V, V^T V = W, they are h numbers without unit."""

    lever: Array | None = None
    touches = (False, False)

    def __init__(self, term: ProblemTerm, order: Ints, offset: Array, info: Array, used: Bools) -> None:
        self.term, self.order, self.offset, self.info, self.used = term, order, offset, info, used
        self.group, self.kind, self.reading, self.columns = term.group, term.kind, term.reading, term.columns
        self.parts = ((0, order.shape[1], WHITE),)
        self.scale = np.repeat(used[:, None], order.shape[1], axis=1).astype(float)
        self.configuration = np.ascontiguousarray(term.configuration[order[:, 0] // term.scale.shape[1]])
        self.pairs, self.pair = np.zeros((0, 2), dtype=np.int64), np.full(len(order), -1, dtype=np.int64)
        self.local = self.pair, self.pair

    def bind(self, column_of: Ints) -> Correlated:
        return Correlated(self.term.bind(column_of), self.order, self.offset, self.info, self.used)

    def without(self, rows: Bools) -> Correlated:
        return Correlated(self.term, self.order, self.offset, self.info, self.used & ~rows)

    def hold(self, family: int) -> Correlated:
        return Correlated(self.term.hold(family), self.order, self.offset, self.info, self.used)

    @cached_property
    def root(self) -> Array:
        """V, (1 or B, U, h, h)."""
        values, vectors = np.linalg.eigh(self.info)
        return np.asarray(np.sqrt(np.maximum(values, 0.0))[..., None] * np.swapaxes(vectors, -1, -2))

    def _numbers(self, x: Array, which: Ints) -> tuple[Array, Array]:
        """Residuals (B, N) and Jacobians (B, N, k) of all numbers of the term."""
        r, jac, _ = self.term.evaluate(x, which, 0, len(self.term.scale))
        shape = len(x), self.term.scale.size
        return np.ascontiguousarray(r.reshape(shape)), np.ascontiguousarray(jac.reshape(*shape, jac.shape[3]))

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        part = slice(first, first + rows)
        r, jac = self._numbers(x, which)
        order, root, offset = self.order[part], self.root[:, part], self.offset[:, part]
        if len(root) > 1:
            root, offset = root[which], offset[which]
        e = r[:, order] + offset
        none = np.zeros((len(x), len(order), order.shape[1], 0))
        return (root @ e[..., None])[..., 0], root @ jac[:, order], none

    def accumulate(self, x: Array, which: Ints, weight: Array, loss: Loss, pair: int, out: Normal) -> bool:
        from robocal.estimate.generalised._kernels import accumulate_correlated

        if loss.kind != 0:
            return False
        many = max(1, CHUNK // max(1, self.term.scale.size * len(self.columns)))
        shared = len(self.info) == 1
        for lo in range(0, len(x), many):
            part = slice(lo, lo + many)
            r, jac = self._numbers(x[part], which[part])
            offset, info = (self.offset, self.info) if shared else (self.offset[which[part]], self.info[which[part]])
            accumulate_correlated(
                r, jac, self.order, offset, info, self.used, weight if len(weight) == 1 else weight[part], self.configuration,
                self.columns, out.cost[part], out.g[part], out.a[part],
            )  # fmt: skip
        return True
