"""Compiled normal equations."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel


@kernel
def robust(kind, tuning, s):
    """Cost rho(s) and weight rho'(s) of a squared whitened norm s; kind 0 none, 1 Huber, 2 Cauchy, 3 Tukey."""
    c2 = tuning * tuning
    if kind == 0:
        return s, 1.0
    if kind == 1:
        if s <= c2:
            return s, 1.0
        root = math.sqrt(s)
        return 2.0 * tuning * root - c2, tuning / root
    if kind == 2:
        return c2 * math.log1p(s / c2), 1.0 / (1.0 + s / c2)
    if s >= c2:
        return c2 / 3.0, 0.0
    u = 1.0 - s / c2
    return c2 / 3.0 * (1.0 - u * u * u), u * u


WIDE = 96  # numbers of a column that are multiplied at once: they stay in the first-level cache
LANES = 4  # columns at once: their sums stay in registers


@kernel
def products(t, count, out):
    """Adds T T^T of the first `count` numbers of every row of t (n, .) to the lower triangle of out (n, n), and to some of the
    upper one; n is a multiple of LANES."""
    for p in range(0, t.shape[0], LANES):
        a, b, c, d = t[p], t[p + 1], t[p + 2], t[p + 3]
        for q in range(0, p + LANES, 2):
            u, v = t[q], t[q + 1]
            au, bu, cu, du = 0.0, 0.0, 0.0, 0.0
            av, bv, cv, dv = 0.0, 0.0, 0.0, 0.0
            for i in range(count):
                x, y = u[i], v[i]
                au += a[i] * x
                bu += b[i] * x
                cu += c[i] * x
                du += d[i] * x
                av += a[i] * y
                bv += b[i] * y
                cv += c[i] * y
                dv += d[i] * y
            out[p, q] += au
            out[p + 1, q] += bu
            out[p + 2, q] += cu
            out[p + 3, q] += du
            out[p, q + 1] += av
            out[p + 1, q + 1] += bv
            out[p + 2, q + 1] += cv
            out[p + 3, q + 1] += dv


@kernel
def accumulate(
    r, jac, jloc, scale, weight, configuration, columns, local, loss, tuning, first, cost, g, a, gl, al, asl
):
    """Adds whitened, weighted rows to the normal equations; cost is half the sum of rho.

    r (B, m, d), jac (B, m, d, k), jloc (B, m, d, l); scale (M, d) = 1 / sigma; weight (1 or B, U) per configuration (M,),
    local (M,) or -1; rows first .. first + m of the (M,) arrays. g (B, n), a (B, n, n) lower triangle, gl (B, L, l),
    al (B, L, l, l), asl (B, L, n, l). r, jac and jloc are whitened in place.
    """
    batch, m, d = r.shape
    k = jac.shape[3]
    nl = jloc.shape[3]
    lanes = (k + LANES - 1) // LANES * LANES
    small_a = np.zeros((lanes, lanes))
    small_g = np.zeros(k)
    wide = max(WIDE, d)
    heap = np.zeros((lanes, wide))  # columns of the rows that wait to be multiplied
    for b in range(batch):
        wb = b if weight.shape[0] > 1 else 0
        small_a[:] = 0.0
        small_g[:] = 0.0
        waiting = 0
        for i in range(m):
            w = weight[wb, configuration[first + i]]
            if w == 0.0:
                continue
            s = 0.0
            for c in range(d):
                r[b, i, c] *= scale[first + i, c]
                s += r[b, i, c] * r[b, i, c]
            rho, slope = robust(loss, tuning, s)
            cost[b] += 0.5 * w * rho
            w *= slope
            if w == 0.0:
                continue
            at = local[first + i] if nl > 0 else -1
            root = math.sqrt(w)
            if waiting + d > wide:
                products(heap, waiting, small_a)
                waiting = 0
            for c in range(d):
                f = scale[first + i, c]
                row = jac[b, i, c]
                wr = w * r[b, i, c]
                for p in range(k):
                    row[p] *= f
                    small_g[p] += wr * row[p]
                    heap[p, waiting] = root * row[p]
                waiting += 1
            if at >= 0:
                for c in range(d):
                    f = scale[first + i, c]
                    row = jac[b, i, c]
                    wr = w * r[b, i, c]
                    lrow = jloc[b, i, c]
                    for p in range(nl):
                        lrow[p] *= f
                    for p in range(nl):
                        gl[b, at, p] += wr * lrow[p]
                        t = w * lrow[p]
                        for q in range(nl):
                            al[b, at, p, q] += t * lrow[q]
                        for q in range(k):
                            asl[b, at, columns[q], p] += t * row[q]
        products(heap, waiting, small_a)
        for p in range(k):
            cp = columns[p]
            g[b, cp] += small_g[p]
            for q in range(p + 1):
                cq = columns[q]
                if cp == cq and p != q:
                    # Two columns of the term feed one tangent column.
                    a[b, cp, cp] += 2.0 * small_a[p, q]
                elif cp >= cq:
                    a[b, cp, cq] += small_a[p, q]
                else:
                    a[b, cq, cp] += small_a[p, q]
