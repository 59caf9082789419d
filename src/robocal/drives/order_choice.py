"""Which orders a sweep shows: one after the other the strongest that is left, as long as arcs that were held out are met better with it.

    keep n  where  mean g_a > t s(g_a) / sqrt(A),    g_a = what arc a leaves without n, less what it leaves with it
            and    G_n > ln(K / 0.05) F_n,           F_n = median G_m / ln 2 over the orders m around n

G_n is what n takes from the squares that are left, fitted together with the orders before. Every arc of 30 degrees is predicted, in both
directions, from all the others; t is that of 95 % on one side. Of K orders that show nothing but noise, whose G is exponential with mean
F, the largest passes the second line once in twenty logs: it was looked for among all of them, and held-out arcs were among those that
made it the largest. Orders that are refused are passed over, and the choice ends after some refusals in a row, or with as many orders as
a table may have.

Where arcs lack, orders are exchanged before held-out arcs are asked (`order_exchange.py`).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robocal._record import record
from robocal._types import Array, Ints
from robocal.drives.moments import Moments
from robocal.drives.order_exchange import exchange_orders, normal_equations

__all__ = ["ChosenOrders", "choose_orders", "find_lag"]

REFUSALS = 6  # grid: in a row; the next orders are weaker still
LAG_STEPS = 24  # grid: of golden sections, to a millionth of the range
CHANCE = 0.05
AROUND = 20  # grid: orders to each side, whose median is the floor
ROUNDS = 5  # grid: of orders at a lag, and of the lag with these
MIXED = 0.1  # grid: harmonics that are less alike are chosen one by one
GOLDEN = (np.sqrt(5.0) - 1) / 2


@record(eq=False)
class ChosenOrders:
    """Orders from the strongest, the lag that goes with them (rad), and the held-out share after each."""

    orders: tuple[int, ...]
    lag: float
    shares: tuple[float, ...]


def find_lag(moments: Moments, orders: tuple[int, ...], reach: float) -> float:
    """The lag within +- reach (rad) that leaves least, by golden sections; 0 where one direction alone was measured."""
    if len(np.unique(moments.direction)) < 2 or not orders:
        return 0.0

    def cost(lag: float) -> float:
        return moments.fit(orders, lag)[1]

    # Beyond a quarter of a period of the highest order the cost has other valleys.
    low, high = -reach, reach
    one, two = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    f, g = cost(one), cost(two)
    for _ in range(LAG_STEPS):
        if f < g:
            high, two, g = two, one, f
            one = high - GOLDEN * (high - low)
            f = cost(one)
        else:
            low, one, f = one, two, g
            two = low + GOLDEN * (high - low)
            g = cost(two)
    return (low + high) / 2


def choose_orders(
    moments: Moments,
    most: int,
    quantile: float,
    reach: float,
    allowed: Callable[[int, tuple[int, ...]], bool] = lambda n, of: True,
) -> ChosenOrders:
    """At most so many orders; `quantile` is t, `reach` the largest lag (rad), and `allowed` says whether an order may follow others."""
    orders: tuple[int, ...] = ()
    waiting: tuple[int, ...] = ()
    lag, pooled = 0.0, moments.pooled
    friction = moments.unseen(())
    before, shares, passed, beside = friction, list[float](), set[int](), set[int]()
    in_a_row, mixed = 0, pooled.mixture > MIXED
    while len(orders) + len(waiting) < most and in_a_row < REFUSALS:
        base = (*orders, *waiting)
        candidates = np.array([n for n in range(1, moments.highest + 1) if n not in passed and allowed(n, base)])
        if not len(candidates):
            break
        normal = normal_equations(pooled, lag)
        gains = normal.gains(orders, candidates)
        best = int(np.argmax(gains))
        order = int(candidates[best])
        passed.add(order)
        in_a_row += 1
        if not gains[best] > np.log(moments.highest / CHANCE) * _floor(gains, candidates, best):
            continue
        for tried in dict.fromkeys(((*orders, order), (*base, order))):
            found, moved = tried, find_lag(moments, tried, reach) if mixed or len(tried) < 4 else lag
            for _ in range(ROUNDS if mixed else 0):
                start = set(found)
                found = exchange_orders(normal_equations(pooled, moved), found, allowed)
                if set(found) == start:
                    break
                moved = find_lag(moments, found, reach)
            after = moments.unseen(found, moved)
            if _surely(before - after, quantile):
                beside |= set(tried) - {*orders, order}
                orders, lag, before, in_a_row = found, moved, after, 0
                passed = (passed - set(tried)) | set(found)
                shares.append(float(1 - after.sum() / friction.sum()))
                break
        waiting = tuple(n for n in (*base, order) if n not in orders)
    orders = _without_idle(moments, orders, beside, lag, quantile)
    return ChosenOrders(orders, find_lag(moments, orders, reach), tuple(shares))


def _surely(gain: Array, quantile: float) -> bool:
    """Whether arcs (A,) that were held out are met better by more than chance."""
    return bool(gain.mean() > quantile * gain.std(ddof=1) / np.sqrt(len(gain)))


def _without_idle(
    moments: Moments, orders: tuple[int, ...], beside: set[int], lag: float, quantile: float
) -> tuple[int, ...]:
    """The orders without those that came in beside others and that held-out arcs do not miss, the least missed first."""
    while doubted := [n for n in orders if n in beside]:
        every = moments.unseen(orders, lag)
        missed = [moments.unseen(tuple(o for o in orders if o != n), lag) - every for n in doubted]
        least = int(np.argmin([m.sum() for m in missed]))
        if _surely(missed[least], quantile):
            break
        orders = tuple(o for o in orders if o != doubted[least])
    return orders


def _floor(gains: Array, orders: Ints, at: int) -> float:
    """What noise takes at an order, from the median around it, and at least from that of all orders: a median of a few is off by a fifth,
    which would let noise pass."""
    others = np.arange(len(orders)) != at
    near = others & (np.abs(orders - orders[at]) <= AROUND)
    return float(max(np.median(gains[some]) if some.any() else 0.0 for some in (near, others)) / np.log(2))
