"""Trigonometric moments of a sweep, of every arc by itself, and what harmonics of any orders and any lag leave of it.

    s_k = sum exp(i k theta),  y_k = sum y exp(i k theta),  q = sum y^2        of the rows of one arc in one direction

Products of harmonics are harmonics of sums and differences of their orders, so these moments hold the normal equations of every set
of orders: cos(n u) cos(m u) = (cos((n - m) u) + cos((n + m) u)) / 2, and so on. A lag L turns s_k by exp(-i k d L). Choosing among
three hundred orders by what held-out arcs say of them then costs no look at the rows.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import record
from robocal._types import Array, Ints

__all__ = ["Moments", "moments_of"]

CHUNK = 4096  # grid: rows at once


@record(eq=False)
class Moments:
    """Moments of G groups of rows: s (G, 2 K + 1), y (G, K + 1), of squares q (G,), of the direction (G,) and the arc (G,) of each; n is
    the number of rows (G,)."""

    s: Array
    y: Array
    q: Array
    n: Array
    direction: Array
    arc: Ints

    @property
    def highest(self) -> int:
        """The highest order that they know."""
        return int(self.y.shape[1]) - 1

    def of(self, direction: float) -> Moments:
        """Those of one direction."""
        some = self.direction == direction
        return Moments(self.s[some], self.y[some], self.q[some], self.n[some], self.direction[some], self.arc[some])

    @property
    def pooled(self) -> Moments:
        """The same of whole directions, where arcs are not asked apart."""
        each, at = np.unique(self.direction, return_inverse=True)
        some = at.ravel() == np.arange(len(each))[:, None]
        arc = np.zeros(len(each), dtype=np.int64)
        return Moments(some @ self.s, some @ self.y, some @ self.q, some @ self.n, each, arc)

    def normal(self, orders: Sequence[int], lag: float = 0.0, by_direction: bool = False) -> tuple[Array, Array]:
        """Normal matrix (G, k, k) and right side (G, k) of each group; columns are 1, d, the cosines, the sines of the orders, and, by
        direction, d times these."""
        n = np.array(orders, dtype=np.int64)
        d = self.direction[:, None]
        turn = np.exp(-1j * d * lag * np.arange(self.s.shape[1]))
        s, y = self.s * turn, self.y * turn[:, : self.y.shape[1]]
        plus, apart = n[:, None] + n, n[:, None] - n
        total, gap = s[:, plus], np.where(apart < 0, s[:, np.abs(apart)].conj(), s[:, np.abs(apart)])
        cc, ss, cs = (gap + total).real / 2, (gap - total).real / 2, (total - gap).imag / 2
        count = len(n)
        a = np.empty((len(s), 2 + 2 * count, 2 + 2 * count))
        a[:, 0, 0], a[:, 1, 1] = self.n, self.n * self.direction**2
        a[:, 0, 1] = a[:, 1, 0] = self.n * self.direction
        cos, sin = slice(2, 2 + count), slice(2 + count, None)
        a[:, 0, cos], a[:, 0, sin] = s[:, n].real, s[:, n].imag
        a[:, 1, cos], a[:, 1, sin] = d * s[:, n].real, d * s[:, n].imag
        a[:, cos, cos], a[:, sin, sin], a[:, cos, sin] = cc, ss, cs
        a[:, 2:, :2] = np.swapaxes(a[:, :2, 2:], 1, 2)
        a[:, sin, cos] = np.swapaxes(cs, 1, 2)
        b = np.concatenate([y[:, :1].real, d * y[:, :1].real, y[:, n].real, y[:, n].imag], axis=1)
        if by_direction:
            wave = a[:, :, 2:] * d[:, :, None]
            square = a[:, 2:, 2:] * (d**2)[:, :, None]
            a = np.block([[a, wave], [np.swapaxes(wave, 1, 2), square]])
            b = np.concatenate([b, d * b[:, 2:]], axis=1)
        return a, b

    def unseen(self, orders: Sequence[int], lag: float = 0.0, by_direction: bool = False) -> Array:
        """The sum of squares that each arc leaves, (A,), of a fit to all the others."""
        a, b = self.normal(orders, lag, by_direction)
        arcs = np.unique(self.arc)
        held = self.arc == arcs[:, None]
        mine_a, mine_b = held @ a.reshape(len(a), -1), held @ b
        mine_a = mine_a.reshape(len(arcs), *a.shape[1:])
        x = np.stack([_solve(a.sum(axis=0) - m, b.sum(axis=0) - v) for m, v in zip(mine_a, mine_b, strict=True)])
        return np.asarray(held @ self.q - 2 * np.sum(x * mine_b, axis=1) + np.einsum("ai,aij,aj->a", x, mine_a, x))

    def fit(self, orders: Sequence[int], lag: float = 0.0, by_direction: bool = False) -> tuple[Array, float]:
        """The coefficients (k,) of a fit to everything, and the sum of squares that it leaves."""
        a, b = (v.sum(axis=0) for v in self.normal(orders, lag, by_direction))
        x = _solve(a, b)
        return x, float(self.q.sum() - b @ x)

    @property
    def mixture(self) -> float:
        """How much harmonics of different orders are alike in these rows: 0 where they cover turns evenly, 1 at one angle."""
        return float(np.abs(self.s[:, 1:].sum(axis=0)).max() / self.n.sum())


def _solve(a: Array, b: Array) -> Array:
    """A x = b where A may lack rank: columns are scaled, and what nothing tells stays zero."""
    scale = np.sqrt(np.maximum(np.diag(a), 1e-300))
    values, vectors = np.linalg.eigh(a / np.outer(scale, scale))
    told = values > 1e-10 * values[-1]  # tolerance: of rounding of normal equations
    return np.asarray(vectors[:, told] @ ((vectors[:, told].T @ (b / scale)) / values[told]) / scale)


def moments_of(angle: Array, effort: Array, direction: Array, arc: Ints, highest: int) -> Moments:
    """Moments of rows (m,) up to an order, by arc and direction (1 or -1)."""
    keys, group = np.unique(np.stack([arc, direction.astype(np.int64)]), axis=1, return_inverse=True)
    group = group.ravel()
    order = np.argsort(group, kind="stable")
    many = keys.shape[1]
    s, y = np.zeros((many, 2 * highest + 1), complex), np.zeros((many, highest + 1), complex)
    edges = np.searchsorted(group[order], np.arange(many + 1))
    for g in range(many):
        rows = order[edges[g] : edges[g + 1]]
        for first in range(0, len(rows), CHUNK):
            some = rows[first : first + CHUNK]
            step, wave, value = np.exp(1j * angle[some]), np.ones(len(some), complex), effort[some]
            for k in range(2 * highest + 1):
                s[g, k] += wave.sum()
                if k <= highest:
                    y[g, k] += wave @ value
                wave *= step
    squares, many_rows = np.bincount(group, effort**2, many), np.bincount(group, minlength=many)
    return Moments(s, y, np.asarray(squares, float), many_rows.astype(float), keys[1].astype(float), keys[0])
