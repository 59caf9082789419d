"""Compiled normal equations and small batched solves."""

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

    r (B, m, d), jac (B, m, d, k), jloc (B, m, d, l); scale (M, d) = 1 / sigma; weight (1 or B, U) per unit; unit (M,), local (M,) or
    -1; rows first .. first + m of the (M,) arrays. g (B, n), a (B, n, n) lower triangle, gl (B, L, l), al (B, L, l, l), asl (B, L, n, l).
    r, jac and jloc are whitened in place.
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
                res = r[b, i, c]
                row = jac[b, i, c]
                for p in range(k):
                    row[p] *= f
                wr = w * res
                for p in range(k):
                    small_g[p] += wr * row[p]
                    t = w * row[p]
                    out = small_a[p]
                    for q in range(p + 1):
                        out[q] += t * row[q]
                if at >= 0:
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


@kernel
def cholesky(a, n):
    """In place, lower triangle; returns False when a pivot is not positive."""
    for i in range(n):
        for j in range(i + 1):
            s = a[i, j]
            for k in range(j):
                s -= a[i, k] * a[j, k]
            if i == j:
                if not s > 0.0:
                    return False
                a[i, i] = math.sqrt(s)
            else:
                a[i, j] = s / a[j, j]
    return True


@kernel
def forward(a, n, v):
    """v <- L^-1 v."""
    for i in range(n):
        s = v[i]
        for k in range(i):
            s -= a[i, k] * v[k]
        v[i] = s / a[i, i]


@kernel
def backward(a, n, v):
    """v <- L^-T v."""
    for i in range(n - 1, -1, -1):
        s = v[i]
        for k in range(i + 1, n):
            s -= a[k, i] * v[k]
        v[i] = s / a[i, i]


@kernel
def damped_step(a, g, al, gl, asl, lam, damp, damp_local, held, step, step_local, predicted, good):
    """Solves (A + lam diag(damp)) step = -g for every problem, local blocks eliminated by Schur complement.

    a (B, n, n) lower triangle, damp (B, n), damp_local (B, L, l), held (B, n) columns that must not move. predicted (B,) is the decrease
    of half the sum of squares that the undamped model promises; good (B,) is False where the damped matrix is not positive.
    """
    batch, n = g.shape
    nloc, nl = gl.shape[1], gl.shape[2]
    s = np.empty((n, n))
    v = np.empty(n)
    block = np.empty((nl, nl))
    bv = np.empty(nl)
    y = np.empty((n, nl))
    for b in range(batch):
        ok = True
        for i in range(n):
            for j in range(i + 1):
                s[i, j] = a[b, i, j]
            s[i, i] += lam[b] * damp[b, i]
            v[i] = -g[b, i]
        for t in range(nloc):
            for i in range(nl):
                for j in range(nl):
                    block[i, j] = al[b, t, i, j]
                block[i, i] += lam[b] * damp_local[b, t, i]
                bv[i] = -gl[b, t, i]
            if not cholesky(block, nl):
                ok = False
                break
            forward(block, nl, bv)
            # y = A_sl L^-T, so that A_sl A_ll^-1 A_ls = y y^T.
            for i in range(n):
                for j in range(nl):
                    x = asl[b, t, i, j]
                    for k in range(j):
                        x -= block[j, k] * y[i, k]
                    y[i, j] = x / block[j, j]
            for i in range(n):
                for j in range(nl):
                    v[i] -= y[i, j] * bv[j]
                for j in range(i + 1):
                    for k in range(nl):
                        s[i, j] -= y[i, k] * y[j, k]
        if ok:
            for i in range(n):
                if held[b, i]:
                    for j in range(n):
                        if j < i:
                            s[i, j] = 0.0
                        elif j > i:
                            s[j, i] = 0.0
                    s[i, i] = 1.0
                    v[i] = 0.0
            ok = cholesky(s, n)
        good[b] = ok
        if not ok:
            continue
        forward(s, n, v)
        backward(s, n, v)
        for i in range(n):
            step[b, i] = v[i]
        gain = 0.0
        for t in range(nloc):
            for i in range(nl):
                for j in range(nl):
                    block[i, j] = al[b, t, i, j]
                block[i, i] += lam[b] * damp_local[b, t, i]
                x = -gl[b, t, i]
                for j in range(n):
                    x -= asl[b, t, j, i] * v[j]
                bv[i] = x
            cholesky(block, nl)
            forward(block, nl, bv)
            backward(block, nl, bv)
            for i in range(nl):
                step_local[b, t, i] = bv[i]
                gain += bv[i] * (lam[b] * damp_local[b, t, i] * bv[i] - gl[b, t, i])
        for i in range(n):
            gain += v[i] * (lam[b] * damp[b, i] * v[i] - g[b, i])
        # For a step that solves the damped system, decrease = 1/2 step . (lam D step - g).
        predicted[b] = 0.5 * gain
