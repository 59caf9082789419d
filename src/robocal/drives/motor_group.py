"""Which of several motors is not like the others.

    R_i = max_j |x_j - mean| / s    of what is left after the i - 1 most extreme were put aside
    R_i > (m - 1) t / sqrt(m (m - 2 + t^2)),    m = n - i + 1 values are left, t of m - 2 degrees of freedom at 1 - p / (2 m k)

Several strange ones do not hide each other: the largest i of k with R_i beyond its bound says how many there are.
k shares the chance, for with as few as eight values more than one test would be passed by chance. x are logarithms of amounts,
for motors of one type differ by parts of them. Source: Rosner, Technometrics 25 (1983) 165.
"""

from __future__ import annotations

import numpy as np

from robocal._scipy import special
from robocal._types import Array

__all__ = ["unlike_others"]

FEWEST = 4  # grid: values, of which one can be strange: three say how they scatter


def unlike_others(values: Array, chance: float, least: float) -> tuple[int, ...]:
    """The indices of amounts (n,) > 0 that are unlike the others, the most extreme first; `chance` is that of any among motors that are
    alike, and `least` the ratio to the median of the others below which motors are alike."""
    x = np.log(np.asarray(values, float))
    left = np.flatnonzero(np.isfinite(x))
    most = max(1, (len(left) - 2) // 3)
    if len(left) < FEWEST:
        return ()
    out, told = list[int](), 0
    for i in range(most):
        m = len(left)
        off = np.abs(x[left] - x[left].mean())
        at = int(np.argmax(off))
        s = float(x[left].std(ddof=1))
        t = float(special.stdtrit(m - 2, 1 - chance / (2 * m * most)))
        bound = (m - 1) * t / np.sqrt(m * (m - 2 + t**2))
        out.append(int(left[at]))
        # Of equal values nothing is strange; beside equal ones any other is.
        if s > 0 and off[at] / s > bound:
            told = i + 1
        left = np.delete(left, at)
    others = float(np.median(x[left]))
    return tuple(k for k in out[:told] if abs(x[k] - others) > np.log(least))
