"""Running sums over the rows of a file, of which every gain of a segment is made; see `robust_model`."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Bools, Ints
from robocal.diagnose.limits import SEGMENT_NUMBERS, SEGMENT_ROWS

__all__ = ["RunningSums", "SegmentScan"]

GRID = 48  # grid: parts of a file, from whose ends the search begins
FLAT = 0.1  # of a column's own information: what the model answers but for this much is not seen
FEWEST = 1e-3  # share of the rows that the fewer are taken for at least


@record
class RunningSums:
    """Running sums over rows, so that every segment is a difference of two: of columns (k, d, q) of what may have moved, what is
    left (k, d), and the columns (k, d, .) of the model, m in all, each number times its weight (k, d)."""

    score: Array  # (e, q)
    own: Array  # (e, q, q)
    cross: Array  # (e, q, m)
    root: Array  # (m, n): the model's answer is that of cross times it

    @classmethod
    def at(
        cls, ends: tuple[int, ...], column: Array, left: Array, weight: Array, model: list[Array], root: Array
    ) -> RunningSums:
        """The sums up to some rows, (e,), 0 the first and all the last."""
        d, q = column.shape[1:]
        turned = (column * weight[..., None]).reshape(-1, q).T

        def up_to(v: Array) -> Array:
            flat = v.reshape(turned.shape[1], -1)
            out = np.zeros((len(ends), q, flat.shape[1]))
            for i, (a, b) in enumerate(pairwise(ends)):
                np.matmul(turned[:, a * d : b * d], flat[a * d : b * d], out=out[i + 1])
            return np.cumsum(out, axis=0, out=out)

        return cls(up_to(left)[..., 0], up_to(column), np.concatenate([up_to(v) for v in model], axis=2), root)

    def gain(self, a: int, b: int) -> tuple[float, Array]:
        """Gain and step (q,) of the segment between two ends."""
        cross = (self.cross[b] - self.cross[a]) @ self.root
        own = self.own[b] - self.own[a]
        gain, step = _gain(
            (self.score[b] - self.score[a])[None],
            (own - cross @ cross.T)[None],
            np.diag(own)[None],
            np.diag(self.own[-1]),
        )
        return float(gain[0]), step[0]

    def step(self, a: int, b: int) -> Array:
        """The step (q,) of one segment with less of that hold: what is seen at all, is seen whole (iterated Tikhonov)."""
        whole = self.score[b] - self.score[a]
        cross = (self.cross[b] - self.cross[a]) @ self.root
        info = self.own[b] - self.own[a] - cross @ cross.T
        found = np.zeros(len(whole))
        for _ in range(4):
            rest = replace(self, score=self.score - self.score)
            rest.score[b] += whole - info @ found
            found = found + rest.gain(a, b)[1]
        return found


def _gain(score: Array, info: Array, diagonal: Array, total: Array) -> tuple[Array, Array]:
    """Gain (p,) and step (p, q) of segments from their scores (p, q), information (p, q, q), and the diagonals of what they would have
    without a model, (p, q), and all rows, (q,); directions that the model answers almost whole are held."""
    size = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    # Of a step in most rows, as much is seen as of one in the few others.
    least = FLAT * np.clip((total - diagonal) / size**2, FEWEST, 1.0)
    held = info / size[:, :, None]
    held /= size[:, None, :]
    np.einsum("pqq->pq", held)[:] += least
    step = np.linalg.solve(held, (score / size)[..., None])[..., 0] / size
    return np.einsum("pq,pq->p", score, step), step


Sums = tuple[Array, Array, Array]  # up to some ends: score (e, q), own (e, q, q), and what the model answers, (e, q, n)


class SegmentScan:
    """The search of the segment that gains most among rows as `RunningSums` has them: all pairs of a grid, then row by row."""

    def __init__(self, column: Array, left: Array, weight: Array, model: list[Array], root: Array) -> None:
        k, d, q = column.shape
        self.column, self.left, self.model, self.root = column, left, model, root
        self.heavy = column * weight[..., None]
        self.fewest = max(SEGMENT_ROWS, math.ceil(SEGMENT_NUMBERS * q / d))
        self.marks = np.unique(np.linspace(0, k, min(GRID, k // 2) + 1).astype(np.int64))
        self.near = 2 * int(np.diff(self.marks).max())
        self.known: dict[int, Sums] = {}  # row by row, from one of the edges to the next
        # Of few rows all are summed at once; of many, those between marks, and single ones where they are asked.
        self.edges = self.marks if k > 4 * GRID else self.marks[[0, -1]]
        self.sums: Sums = self._between_edges()
        self.total = np.einsum("qq->q", self.sums[1][-1])

    def find(self) -> tuple[int, int] | None:
        """First row and end of the segment that gains most, with enough rows inside and outside."""
        at, k = self.marks, len(self.column)
        score, own, answer = self.sums if len(self.edges) == len(at) else (v[at] for v in self._row_by_row(0))
        a, b = np.triu_indices(len(at), 1)
        fit = self._fit(at[b] - at[a])
        if not fit.any():
            return None
        a, b = a[fit], b[fit]
        e, q = score.shape
        flat = answer.reshape(e * q, -1)
        products = (flat @ flat.T).reshape(e, q, e, q)
        alone = np.einsum("epeq->epq", products)
        # In place: of so many pairs every array that is made anew costs as much as what is done with it.
        info = (own - alone)[b]
        info -= (own + alone)[a]
        info += products[a, :, b]
        info += products[b, :, a]
        diagonal = np.einsum("eqq->eq", own)
        best = int(_gain(score[b] - score[a], info, diagonal[b] - diagonal[a], self.total)[0].argmax())
        first, last = int(at[a[best]]), int(at[b[best]])
        # One end after the other, until both stay.
        for _ in range(4):
            before = first, last
            first = self._move(max(first - self.near, 0), min(first + self.near, last), last, first)
            last = self._move(max(last - self.near, first), min(last + self.near, k), first, last)
            if (first, last) == before:
                break
        return first, last

    def _fit(self, rows: Ints) -> Bools:
        """Which segments of so many rows have enough of them, inside and outside."""
        return np.asarray((rows >= self.fewest) & (len(self.column) - rows >= self.fewest))

    def _move(self, lo: int, hi: int, other: int, here: int) -> int:
        """The end among the rows lo to hi with which a segment gains most, where its other end stays; `here` where none has enough rows."""
        tried = np.arange(lo, hi + 1)
        tried = tried[self._fit(np.abs(other - tried))]
        if not len(tried):
            return here
        there, mine = self._up_to(other, other), self._up_to(int(tried[0]), int(tried[-1]))
        score, own, answer = (one - many if other > here else many - one for one, many in zip(there, mine, strict=True))
        if len(score) > len(tried):
            score, own, answer = (v[tried - tried[0]] for v in (score, own, answer))
        info = own - answer @ answer.transpose(0, 2, 1)
        return int(tried[_gain(score, info, np.einsum("pqq->pq", own), self.total)[0].argmax()])

    def _up_to(self, lo: int, hi: int) -> Sums:
        """The sums up to every row of lo to hi."""
        first, last = np.searchsorted(self.edges, (lo, max(hi - 1, lo)), side="right") - 1
        blocks = range(min(int(first), len(self.edges) - 2), min(int(last), len(self.edges) - 2) + 1)
        begin = int(self.edges[blocks[0]])
        # Where a block ends, the next one begins.
        parts = [self._row_by_row(i) for i in blocks]
        if len(parts) == 1:
            score, own, answer = parts[0]
        else:
            score, own, answer = (
                np.concatenate([*(v[:-1] for v in some[:-1]), some[-1]]) for some in zip(*parts, strict=True)
            )
        return tuple(v[lo - begin : hi - begin + 1] for v in (score, own, answer))  # type: ignore[return-value]

    def _between_edges(self) -> Sums:
        """The sums up to every edge."""
        d, q = self.column.shape[1:]
        turned = self.heavy.reshape(-1, q).T

        def up_to(*some: Array) -> Array:
            flat = [v.reshape(turned.shape[1], -1) for v in some]
            out = np.zeros((len(self.edges), q, sum(v.shape[1] for v in flat)))
            for i, (a, b) in enumerate(pairwise((self.edges * d).tolist())):
                np.concatenate([turned[:, a:b] @ v[a:b] for v in flat], axis=1, out=out[i + 1])
            return np.cumsum(out, axis=0, out=out)

        return up_to(self.left)[..., 0], up_to(self.column), up_to(*self.model) @ self.root

    def _row_by_row(self, block: int) -> Sums:
        """The sums up to every row from one edge to the next."""
        if block not in self.known:
            some = slice(int(self.edges[block]), int(self.edges[block + 1]))
            turned = self.heavy[some].transpose(0, 2, 1)
            k, d = turned.shape[0], turned.shape[2]
            rows = np.concatenate([v[some] for v in self.model], axis=2) if len(self.model) > 1 else self.model[0][some]
            answer = (rows.reshape(k * d, -1) @ self.root).reshape(k, d, -1)

            def running(by: Array, begin: Array) -> Array:
                out = np.empty((k + 1, *begin.shape))
                out[0] = begin
                np.matmul(turned, by, out=out[1:])
                return np.cumsum(out, axis=0, out=out)

            score, own, begun = (v[block] for v in self.sums)
            score = running(self.left[some, :, None], score[:, None])[..., 0]
            self.known[block] = score, running(self.column[some], own), running(answer, begun)
        return self.known[block]
