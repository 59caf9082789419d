"""Orders that are fitted together: what a set of them leaves of a sweep, what one more takes, and which set of as many leaves least.

    gain of n = r^T S^-1 r,    r = b_n - A_no A_oo^-1 b_o,    S = A_nn - A_no A_oo^-1 A_on      o what is fitted already

Where rows cover turns evenly, harmonics are orthogonal, and the strongest orders are the best set. Where arcs lack, as after escapes,
harmonics are alike in the rows that are left: two orders may be chosen one after the other that stand where two others are right. So one
order, then two at once, are exchanged for those that leave least in their place, as long as less is left.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np

from robocal._record import record
from robocal._types import Array, Ints
from robocal.drives.moments import Moments

__all__ = ["NormalEquations", "exchange_orders", "normal_equations"]

RIDGE = 1e-6  # tolerance: of scaled columns; harmonics that nothing parts share what they explain
NOTHING = 1e-6  # tolerance: of the squares that are left
STRONGEST = 12  # grid: orders that are tried as the first of two
PAIRS = 8  # grid: of more orders two at once would take seconds

Allowed = Callable[[int, tuple[int, ...]], bool]


@record(eq=False)
class NormalEquations:
    """A (2 + 2 K, 2 + 2 K) and b of 1, the direction, and the cosines and sines of all orders 1 to K; the squares q of the effort."""

    a: Array
    b: Array
    q: float

    @property
    def highest(self) -> int:
        """K."""
        return len(self.b) // 2 - 1

    def left(self, orders: tuple[int, ...]) -> float:
        """The sum of squares that the orders leave."""
        at = self._columns(orders)
        return self.q - float(self.b[at] @ self._inverse(at) @ self.b[at])

    def gains(self, orders: tuple[int, ...], candidates: Ints) -> Array:
        """How much less each candidate (C,) leaves, fitted together with the orders."""
        at = self._columns(orders)
        inverse = self._inverse(at)
        cos, sin = 1 + candidates, 1 + self.highest + candidates
        every = np.concatenate([cos, sin])
        across = self.a[np.ix_(at, every)]
        share = inverse @ across
        right = self.b[every] - share.T @ self.b[at]
        u, v = np.split(right, 2)
        (x, y), (p, q) = np.split(across, 2, axis=1), np.split(share, 2, axis=1)
        cc = (1 + RIDGE) * self.a[cos, cos] - np.sum(x * p, axis=0)
        ss = (1 + RIDGE) * self.a[sin, sin] - np.sum(y * q, axis=0)
        cs = self.a[cos, sin] - np.sum(x * q, axis=0)
        return np.asarray((ss * u * u - 2 * cs * u * v + cc * v * v) / np.maximum(cc * ss - cs**2, 1e-300))

    def best(self, orders: tuple[int, ...], candidates: Ints) -> tuple[float, tuple[int, ...]]:
        """What is left with the best candidate, and the orders with it."""
        gains = self.gains(orders, candidates)
        at = int(np.argmax(gains))
        return self.left(orders) - float(gains[at]), (*orders, int(candidates[at]))

    def _columns(self, orders: tuple[int, ...]) -> Ints:
        return np.array([0, 1, *(1 + n for n in orders), *(1 + self.highest + n for n in orders)])

    def _inverse(self, at: Ints) -> Array:
        some = self.a[np.ix_(at, at)]
        scale = np.sqrt(np.maximum(np.diag(some), 1e-300))
        both = np.outer(scale, scale)
        return np.asarray(np.linalg.inv(some / both + RIDGE * np.eye(len(at))) / both)


def normal_equations(moments: Moments, lag: float) -> NormalEquations:
    """Those of all orders that the moments know, at a lag (rad)."""
    a, b = moments.normal(range(1, moments.highest + 1), lag)
    return NormalEquations(a.sum(axis=0), b.sum(axis=0), float(moments.q.sum()))


def exchange_orders(normal: NormalEquations, orders: tuple[int, ...], allowed: Allowed) -> tuple[int, ...]:
    """The orders after exchanges, each the one that leaves least, as long as less is left."""
    left = normal.left(orders)
    while True:
        tried = min(_ones(normal, orders, allowed), default=(left, orders))
        if not tried[0] < left * (1 - NOTHING) and 1 < len(orders) <= PAIRS:
            tried = min(_twos(normal, orders, allowed), default=tried)
        if not tried[0] < left * (1 - NOTHING):
            return orders
        left, orders = tried


def _free(normal: NormalEquations, orders: tuple[int, ...], rest: tuple[int, ...], allowed: Allowed) -> Ints:
    return np.array([n for n in range(1, normal.highest + 1) if n not in orders and allowed(n, rest)], dtype=np.int64)


def _ones(normal: NormalEquations, orders: tuple[int, ...], allowed: Allowed) -> list[tuple[float, tuple[int, ...]]]:
    rests = [orders[:i] + orders[i + 1 :] for i in range(len(orders))]
    some = [(rest, _free(normal, orders, rest, allowed)) for rest in rests]
    return [normal.best(rest, free) for rest, free in some if len(free)]


def _twos(normal: NormalEquations, orders: tuple[int, ...], allowed: Allowed) -> list[tuple[float, tuple[int, ...]]]:
    out = []
    for gone in combinations(orders, 2):
        rest = tuple(n for n in orders if n not in gone)
        free = _free(normal, orders, rest, allowed)
        first = free[np.argsort(normal.gains(rest, free))[::-1][:STRONGEST]] if len(free) else free
        for one in first.tolist():
            second = _free(normal, (*orders, one), (*rest, one), allowed)
            if len(second):
                out.append(normal.best((*rest, one), second))
    return out
