"""Numbers that share an error: the information that is left of them, and their normal equations."""

from __future__ import annotations

import numpy as np

from robocal._jit import kernel
from robocal.estimate._kernels import add_shared_columns, backward, cholesky, forward


@kernel
def marginal(jloc, scale, order, block, hold, info, root):
    """What h numbers tell when the block (l,) that they share is not known beyond its prior: W = D - D J S^-1 J^T D.

    jloc (B, N, l), scale (N,) = 1 / sigma, D = scale^2; order (U, h) numbers of configuration u, of the block block[u];
    S = H^T H + J^T D J with hold H (B, L, l, l). Fills info (B, U, h, h) and root (B, U, l, l), S = root root^T. Returns the first u
    whose S is not positive definite, or -1.
    """
    batch, size = jloc.shape[0], jloc.shape[2]
    many, h = order.shape
    y = np.empty((h, size))  # rows L^-1 J^T D^(1/2)
    for b in range(batch):
        for u in range(many):
            prior, s, w = hold[b, block[u]], root[b, u], info[b, u]
            for i in range(size):
                for j in range(i + 1):
                    t = 0.0
                    for o in range(size):
                        t += prior[o, i] * prior[o, j]
                    for p in range(h):
                        at = order[u, p]
                        t += scale[at] * jloc[b, at, i] * scale[at] * jloc[b, at, j]
                    s[i, j] = t
                    s[j, i] = 0.0 if i != j else t
            if not cholesky(s, size):
                return u
            for p in range(h):
                at = order[u, p]
                for i in range(size):
                    y[p, i] = scale[at] * jloc[b, at, i]
                forward(s, size, y[p])
            for p in range(h):
                for q in range(p + 1):
                    t = 1.0 if p == q else 0.0
                    for i in range(size):
                        t -= y[p, i] * y[q, i]
                    w[p, q] = scale[order[u, p]] * t * scale[order[u, q]]
                    w[q, p] = w[p, q]
    return -1


@kernel
def place(r, jloc, scale, order, block, hold, off, root, step):
    """The step (B, L, l) that takes every block to where its prior and the residuals r (B, N) want it; off (B, L, l) is H^T times
    the whitened distance to the prior. The rest is as in `marginal`."""
    batch, size = jloc.shape[0], jloc.shape[2]
    many, h = order.shape
    for b in range(batch):
        for u in range(many):
            v = step[b, block[u]]
            for i in range(size):
                t = off[b, block[u], i]
                for p in range(h):
                    at = order[u, p]
                    t += scale[at] * scale[at] * jloc[b, at, i] * r[b, at]
                v[i] = -t
            forward(root[b, u], size, v)
            backward(root[b, u], size, v)


@kernel
def accumulate_correlated(r, jac, order, offset, info, used, weight, configuration, columns, cost, g, a):
    """Adds numbers that are correlated within a configuration to the normal equations of the shared columns.

    r (B, N), jac (B, N, k): only what is not zero of a row is multiplied; offset (1 or B, U, h) is added to the residual, info (1 or
    B, U, h, h) its information; used (U,), weight (1 or B, U').
    """
    batch, k = jac.shape[0], jac.shape[2]
    many, h = order.shape
    small_a, small_g = np.empty((k, k)), np.empty(k)
    where, count = np.empty((h, k), np.int64), np.empty(h, np.int64)
    e, we = np.empty(h), np.empty(h)
    for b in range(batch):
        wb = b if weight.shape[0] > 1 else 0
        ib = b if info.shape[0] > 1 else 0
        small_a[:] = 0.0
        small_g[:] = 0.0
        for u in range(many):
            f = weight[wb, configuration[u]]
            if f == 0.0 or not used[u]:
                continue
            w = info[ib, u]
            for p in range(h):
                row = jac[b, order[u, p]]
                e[p] = r[b, order[u, p]] + offset[ib, u, p]
                count[p] = 0
                for i in range(k):
                    if row[i] != 0.0:
                        where[p, count[p]] = i
                        count[p] += 1
            for p in range(h):
                t = 0.0
                for q in range(h):
                    t += w[p, q] * e[q]
                we[p] = f * t
                cost[b] += 0.5 * we[p] * e[p]
            for p in range(h):
                row = jac[b, order[u, p]]
                for s in range(count[p]):
                    i = where[p, s]
                    small_g[i] += row[i] * we[p]
                for q in range(p):
                    other, fw = jac[b, order[u, q]], f * w[p, q]
                    beyond = count[p] > 0 and count[q] > 0 and where[p, 0] > where[q, count[q] - 1]
                    for s in range(count[p]):
                        i = where[p, s]
                        v = fw * row[i]
                        for t in range(count[q]):
                            j = where[q, t]
                            if beyond or i > j:
                                small_a[i, j] += v * other[j]
                            elif i == j:
                                small_a[i, i] += 2.0 * v * other[i]
                            else:
                                small_a[j, i] += v * other[j]
                for s in range(count[p]):
                    i = where[p, s]
                    v = f * w[p, p] * row[i]
                    for t in range(s + 1):
                        j = where[p, t]
                        small_a[i, j] += v * row[j]
        add_shared_columns(columns, small_g, small_a, g[b], a[b])
