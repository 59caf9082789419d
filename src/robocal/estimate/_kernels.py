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


@kernel
def accumulate(r, jac, jloc, scale, weight, unit, columns, local, loss, tuning, first, cost, g, a, gl, al, asl):
    """Adds whitened, weighted rows to the normal equations; cost is half the sum of rho.

    r (B, m, d), jac (B, m, d, k), jloc (B, m, d, l); scale (M, d) = 1 / sigma; weight (1 or B, U) per unit; unit (M,),
    local (M,) or -1; rows first .. first + m of the (M,) arrays. g (B, n), a (B, n, n) lower triangle, gl (B, L, l),
    al (B, L, l, l), asl (B, L, n, l). r, jac and jloc are whitened in place.
    """
    batch, m, d = r.shape
    k = jac.shape[3]
    nl = jloc.shape[3]
    small_a = np.zeros((k, k))
    small_g = np.zeros(k)
    for b in range(batch):
        wb = b if weight.shape[0] > 1 else 0
        small_a[:] = 0.0
        small_g[:] = 0.0
        for i in range(m):
            w = weight[wb, unit[first + i]]
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
            for c in range(d):
                f = scale[first + i, c]
                row = jac[b, i, c]
                wr = w * r[b, i, c]
                for p in range(k):
                    row[p] *= f
                    small_g[p] += wr * row[p]
            if d == 3:
                # Points are the common case: three rows at once keep the sums in registers.
                x, y, z = jac[b, i, 0], jac[b, i, 1], jac[b, i, 2]
                for p in range(k):
                    tx, ty, tz = w * x[p], w * y[p], w * z[p]
                    out = small_a[p]
                    for q in range(p + 1):
                        out[q] += tx * x[q] + ty * y[q] + tz * z[q]
            else:
                for c in range(d):
                    row = jac[b, i, c]
                    for p in range(k):
                        t = w * row[p]
                        out = small_a[p]
                        for q in range(p + 1):
                            out[q] += t * row[q]
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
