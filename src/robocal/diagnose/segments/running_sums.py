"""Running sums over the rows of a file, of which every gain of a segment is made; see `robust_model`."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.diagnose.limits import SEGMENT_NUMBERS, SEGMENT_ROWS

__all__ = ["RunningSums", "sharpen_ends"]

FLAT = 0.1  # of a column's own information: what the model answers but for this much is not seen
FEWEST = 1e-3  # share of the rows that the fewer are taken for at least


@record
class RunningSums:
    """Running sums over rows, so that every segment is a difference of two: of columns (k, d, q) of what may have moved, what is
    left (k, d), and the Jacobian (k, d, m) of the model, each number times its weight (k, d)."""

    score: Array  # (k + 1, q)
    own: Array  # (k + 1, q, q)
    cross: Array  # (k + 1, q, m)
    root: Array  # (m, n): the model's answer is that of cross times it
    fewest: int  # rows of a segment, and beside it

    @classmethod
    def of(cls, column: Array, left: Array, weight: Array, jacobian: Array, root: Array) -> RunningSums:
        def running(v: Array, by: Array) -> Array:
            """The sums up to each row of v by, in place: of many rows the products alone fill the memory."""
            out = np.zeros((len(v) + 1, v.shape[1], by.shape[2]))
            np.matmul(v, by, out=out[1:])
            np.cumsum(out[1:], axis=0, out=out[1:])
            return out

        turned = (column * weight[..., None]).transpose(0, 2, 1)
        fewest = max(SEGMENT_ROWS, math.ceil(SEGMENT_NUMBERS * column.shape[2] / column.shape[1]))
        score, own, cross = (running(turned, v) for v in (left[..., None], column, jacobian))
        return cls(score[..., 0], own, cross, root, fewest)

    @classmethod
    def at(
        cls, ends: tuple[int, ...], column: Array, left: Array, weight: Array, jac: Array, root: Array
    ) -> RunningSums:
        """The sums up to some rows alone, (e,), 0 the first."""
        d, q = column.shape[1:]
        turned = (column * weight[..., None]).reshape(-1, q).T

        def up_to(v: Array) -> Array:
            parts = (slice(a * d, b * d) for a, b in pairwise((0, *ends)))
            return np.cumsum([turned[:, part] @ v.reshape(turned.shape[1], -1)[part] for part in parts], axis=0)

        return cls(up_to(left)[..., 0], up_to(column), up_to(jac), root, 0)

    def take(self, ends: list[int]) -> RunningSums:
        """The same up to some rows alone."""
        return replace(self, score=self.score[ends], own=self.own[ends], cross=self.cross[ends])

    def answer(self, a: Ints | int, b: Ints | int) -> Array:
        """What the model answers of segments a <= i < b, (..., q, n)."""
        return np.asarray((self.cross[b] - self.cross[a]) @ self.root)

    def gain(self, a: Ints, b: Ints) -> tuple[Array, Array]:
        """Gain (p,) and step (p, q) of segments a <= i < b; directions that the model answers almost whole are held."""
        score = self.score[b] - self.score[a]
        own = self.own[b] - self.own[a]
        info = own - self._model_products(a, b)
        diagonal, total = np.einsum("pqq->pq", own), np.diag(self.own[-1])
        size = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
        # Of a step in most rows, as much is seen as of one in the few others.
        least = FLAT * np.clip((total - diagonal) / size**2, FEWEST, 1.0)
        held = info / (size[:, :, None] * size[:, None, :]) + least[:, :, None] * np.eye(own.shape[1])
        step = np.linalg.solve(held, (score / size)[..., None])[..., 0] / size
        return np.einsum("pq,pq->p", score, step), step

    def _model_products(self, a: Ints, b: Ints) -> Array:
        """What the model answers of segments, C C^T with C = answer(a, b), (p, q, q); of many pairs of few ends, from the products of
        the ends."""
        q = self.cross.shape[1]
        ends, at = np.unique(np.concatenate([a, b]), return_inverse=True)
        # Where one end of all pairs is the same, the ends outnumber the pairs: their products would fill the memory.
        if len(ends) ** 2 > 4 * len(a):
            cross = self.answer(a, b)
            return np.asarray(cross @ cross.transpose(0, 2, 1))
        flat = self.cross[ends].reshape(len(ends) * q, -1) @ self.root
        products = (flat @ flat.T).reshape(len(ends), q, len(ends), q).transpose(0, 2, 1, 3)
        first, last = at[: len(a)], at[len(a) :]
        mixed = products[first, last]
        return np.asarray(products[first, first] + products[last, last] - mixed - mixed.transpose(0, 2, 1))

    def step(self, a: int, b: int) -> Array:
        """The step (q,) of one segment with less of that hold: what is seen at all, is seen whole (iterated Tikhonov)."""
        whole = self.score[b] - self.score[a]
        cross = self.answer(a, b)
        info = self.own[b] - self.own[a] - cross @ cross.T
        found = np.zeros(len(whole))
        for _ in range(4):
            rest = replace(self, score=self.score - self.score)
            rest.score[b] += whole - info @ found
            found = found + rest.gain(np.array([a]), np.array([b]))[1][0]
        return found

    def best(self, a: Ints, b: Ints) -> tuple[int, int] | None:
        """The pair that gains most, with enough rows inside and outside."""
        k = len(self.score) - 1
        fit = (b - a >= self.fewest) & (k - (b - a) >= self.fewest)
        if not fit.any():
            return None
        at = int(self.gain(a[fit], b[fit])[0].argmax())
        return int(a[fit][at]), int(b[fit][at])


def sharpen_ends(sums: RunningSums, first: int, last: int, near: int) -> tuple[int, int]:
    """The ends of a segment row by row, one end after the other until both stay."""
    k = len(sums.score) - 1
    for _ in range(4):
        before = first, last
        tried = np.arange(max(first - near, 0), min(first + near, last) + 1)
        first, last = sums.best(tried, np.full_like(tried, last)) or before
        tried = np.arange(max(last - near, first), min(last + near, k) + 1)
        first, last = sums.best(np.full_like(tried, first), tried) or (first, last)
        if (first, last) == before:
            break
    return first, last
