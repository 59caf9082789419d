"""Which orders of ripple a joint has: sought one pair (cos, sin) at a time, in what the other columns leave.

    gain(pair) = v^T (C + f I)^-1 v,    C, v: the pair's part of the Gram matrix with all chosen columns projected out

The largest gain enters while it exceeds f 2 ln(candidates / LEVEL), which the largest of so many pairs of pure noise
exceeds once in 1 / LEVEL times. Reference: Chen, Billings and Luo, Orthogonal least squares methods and their
application to non-linear system identification (1989).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from robocal.arms.chain import Chain, Group
from robocal.arms.groups import add, without
from robocal.arms.joints import orders_of, turning

__all__ = ["HIGHEST", "candidates", "orders", "seek"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
HIGHEST = 64
LEVEL = 1e-3


def candidates(model: Chain, group: Group) -> tuple[Chain, dict[str, tuple[float, ...]]]:
    """The model with every order up to the group's `highest` that a joint does not have yet, and these orders."""
    highest = int(group.options.get("highest", HIGHEST))
    there = orders_of(model)
    found = {
        j: tuple(float(k) for k in range(1, highest + 1) if k not in there.get(j, ()))
        for j in turning(model, tuple(group.options.get("joints", ())))
    }
    options = {**group.options, "harmonics": found}
    return add(without(model, group.name), group.name, options), found


def seek(gram: Array, base: Ints, pairs: Ints, noise: float, rows: int) -> Ints:
    """The numbers of the pairs (p, 2) that enter, in order of gain; gram (n + 1, n + 1) has the residual last."""
    if not len(pairs):
        return np.zeros(0, dtype=np.int64)
    rest = np.array([*pairs.ravel(), len(gram) - 1])
    inner = gram[np.ix_(base, base)] + noise * np.eye(len(base))
    cross = gram[np.ix_(base, rest)]
    c = gram[np.ix_(rest, rest)] - cross.T @ np.linalg.solve(inner, cross)
    limit = 2.0 * np.log(len(pairs) / LEVEL)
    first = np.arange(0, 2 * len(pairs), 2)
    chosen: list[int] = []
    open_ = np.ones(len(pairs), dtype=bool)
    while open_.any():
        left = max(c[-1, -1], 0.0) / max(rows - len(base) - 2 * len(chosen), 1)
        a, b, d = c[first, first] + left, c[first, first + 1], c[first + 1, first + 1] + left
        u, v = c[first, -1], c[first + 1, -1]
        gain = np.where(open_, (d * u**2 - 2 * b * u * v + a * v**2) / (a * d - b**2), 0.0)
        best = int(np.argmax(gain))
        if gain[best] <= left * limit:
            break
        chosen.append(best)
        open_[best] = False
        two = [2 * best, 2 * best + 1]
        c -= c[:, two] @ np.linalg.solve(c[np.ix_(two, two)] + left * np.eye(2), c[two])
    return np.array(chosen, dtype=np.int64)


def orders(found: Ints, labels: Sequence[tuple[str, float]]) -> dict[str, tuple[float, ...]]:
    """The orders of every joint, ascending, of the pairs that entered."""
    out: dict[str, list[float]] = {}
    for i in np.sort(found):
        joint, order = labels[i]
        out.setdefault(joint, []).append(order)
    return {joint: tuple(sorted(values)) for joint, values in out.items()}
