"""Compiled tension factor: the least ratio of pulls to either side of the hyperplanes that cable directions span."""

from __future__ import annotations

import numpy as np

from robocal._jit import kernel
from robocal.cables.balance._kernels import factor, null_rows
from robocal.cables.margin._kernels import dependency

_NONE = 1e-11  # of the greatest pull: what rounding leaves of one that is none


@kernel
def factor_kernel(w, out):
    """out (k,) <- min over hyperplanes of min(P, N) / max(P, N), zero where W (k, d, m) has not full rank; m > d."""
    count, d, m = w.shape
    r = m - d
    h, n = np.empty((d, m)), np.empty((m, m))
    diagonal, tau, order = np.empty(d), np.empty(d), np.empty(d, np.int64)
    chosen, column = np.empty(r + 1, np.int64), np.empty(r + 1, np.int64)
    s, work = np.empty(r + 1), np.empty((r + 1, r + 1))
    for k in range(count):
        for i in range(d):
            for j in range(m):
                h[i, j] = w[k, i, j]
        out[k] = 0.0
        if factor(h, diagonal, tau, order) < d:
            continue
        null_rows(h, tau, d, n)
        least = 1.0
        for j in range(r + 1):
            chosen[j] = j
        while True:
            if dependency(n, r, chosen, work, column, s) > 0.0:
                top = 0.0
                for j in range(r + 1):
                    top = max(top, abs(s[j]))
                ahead, behind = 0.0, 0.0
                for j in range(r + 1):
                    if s[j] > _NONE * top:
                        ahead += s[j]
                    elif s[j] < -_NONE * top:
                        behind -= s[j]
                least = min(least, min(ahead, behind) / max(ahead, behind))
            j = r
            while j >= 0 and chosen[j] == m - r - 1 + j:
                j -= 1
            if j < 0:
                break
            chosen[j] += 1
            for i in range(j + 1, r + 1):
                chosen[i] = chosen[i - 1] + 1
        out[k] = least
