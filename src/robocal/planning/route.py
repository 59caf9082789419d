"""A short way through many poses: nearest neighbour, then 2-opt, by the time that the slowest joint takes.

    d(a, b) = max_j |a_j - b_j| / speed_j

The way is open: it starts at the pose nearest to a given one and need not return. Reference: Croes, A method for
solving traveling-salesman problems (1958).
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Ints
from robocal.arms.chain import Chain

__all__ = ["length", "short_path", "travel"]

# A quarter of a metre takes as long as a quarter turn.
SPEED = {"revolute": 1.0, "prismatic": 0.5 / np.pi}
SWEEPS = 50


def travel(chain: Chain, q: Array) -> Array:
    """How far every pose is from every other, (m, m), in rad of the slowest joint."""
    scaled = q / np.array([SPEED.get(j.type, 1.0) for j in chain.joints])
    return np.asarray(np.abs(scaled[:, None] - scaled[None]).max(axis=-1))


def length(distance: Array, order: Ints) -> float:
    """The length of an open way."""
    return float(distance[order[:-1], order[1:]].sum())


def short_path(distance: Array, first: int) -> Ints:
    """An order of all poses (m,) that begins at `first`; distance (m, m) symmetric."""
    left = np.ones(len(distance), dtype=bool)
    order = [first]
    left[first] = False
    while left.any():
        d = np.where(left, distance[order[-1]], np.inf)
        order.append(int(np.argmin(d)))
        left[order[-1]] = False
    return _two_opt(distance, np.array(order, dtype=np.int64))


def _two_opt(distance: Array, order: Ints) -> Ints:
    """Reverses the piece i .. k of the way while that shortens it most; the first pose stays."""
    m = len(order)
    ends = np.triu_indices(m - 1, 0)
    i, k = ends[0] + 1, ends[1] + 1
    for _ in range(SWEEPS * m):
        d = distance[np.ix_(order, order)]
        # The last pose has no successor, so nothing is gained or lost there.
        after = np.minimum(k + 1, m - 1)
        last = k == m - 1
        change = d[i - 1, k] - d[i - 1, i] + np.where(last, 0.0, d[i, after] - d[k, after])
        if not len(change) or change.min() > -1e-12:
            break
        best = int(np.argmin(change))
        order[i[best] : k[best] + 1] = order[i[best] : k[best] + 1][::-1].copy()
    return order
