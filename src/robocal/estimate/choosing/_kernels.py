"""Compiled pivoting."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel


@kernel
def pivot(work, tolerance, order):
    """How many columns are kept by pivoted Gram-Schmidt: they come first in order (n,), as they were taken, then the others as they
    stood. work (n, m) has a column in each row and is lost; tolerance (n,) is what each has to exceed."""
    n, m = work.shape
    norms = np.empty(n)
    for kept in range(n):
        best, most = -1, -1.0
        for i in range(kept, n):
            c = order[i]
            s = 0.0
            for k in range(m):
                s += work[c, k] * work[c, k]
            norms[c] = math.sqrt(s)
            # A small handicap for later columns makes ties between exactly equal columns go to the first, on every machine.
            if norms[c] > tolerance[c] and norms[c] * (1.0 - 1e-7 * (i - kept)) > most:
                best, most = i, norms[c] * (1.0 - 1e-7 * (i - kept))
        if best < 0:
            return kept
        q = order[best]
        for i in range(best, kept, -1):
            order[i] = order[i - 1]
        order[kept] = q
        for k in range(m):
            work[q, k] /= norms[q]
        for _ in range(2):
            for i in range(kept + 1, n):
                c = order[i]
                s = 0.0
                for k in range(m):
                    s += work[q, k] * work[c, k]
                for k in range(m):
                    work[c, k] -= s * work[q, k]
    return n
