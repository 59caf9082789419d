"""Compiled normal equations, and small triangular systems."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel


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
def robust_weights(kind, tuning, squares, out):
    """out (m,) <- the weights of squared whitened norms (m,)."""
    for i in range(len(squares)):
        out[i] = robust(kind, tuning, squares[i])[1]


@kernel(inline=True)
def kept(kind, tuning, s):
    """Which share of the columns along the residual a loss keeps when its curvature counts, sqrt(1 + 2 s rho'' / rho'), not below
    zero: rho'' bends the cost less than rho' says. Reference: Triggs et al. (2000), section 4.3."""
    u = s / (tuning * tuning)
    if kind == 0 or (kind == 1 and u <= 1.0):
        return 1.0
    if kind == 1:
        return 0.0
    if kind == 2:
        return math.sqrt(max((1.0 - u) / (1.0 + u), 0.0))
    return math.sqrt(max((1.0 - 5.0 * u) / (1.0 - u), 0.0)) if u < 1.0 else 0.0


@kernel(inline=True)
def shorten(rows, r, share):
    """Takes 1 - share of the columns along the residual r (d,) from whitened rows (d, k) of one observation."""
    d, k = rows.shape
    s = 0.0
    for c in range(d):
        s += r[c] * r[c]
    if s == 0.0:
        return
    f = (1.0 - share) / s
    for p in range(k):
        q = 0.0
        for c in range(d):
            q += r[c] * rows[c, p]
        q *= f
        for c in range(d):
            rows[c, p] -= q * r[c]


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
def add_block(at, w, lrow, row, columns, al, asl):
    """Adds one whitened row to the matrix of a local block: lrow its columns, row those that are shared."""
    k, nl = row.shape[0], lrow.shape[0]
    for p in range(nl):
        t = w * lrow[p]
        for q in range(nl):
            al[at, p, q] += t * lrow[q]
        for q in range(k):
            asl[at, columns[q], p] += t * row[q]


@kernel(inline=True)
def add_shared_columns(columns, small_g, small_a, g, a):
    """Adds what one term's columns say, k of them, to the free columns that they feed; lower triangle."""
    for p in range(columns.shape[0]):
        cp = columns[p]
        g[cp] += small_g[p]
        for q in range(p + 1):
            cq = columns[q]
            if cp == cq and p != q:
                # Two columns of the term feed one tangent column.
                a[cp, cp] += 2.0 * small_a[p, q]
            elif cp >= cq:
                a[cp, cq] += small_a[p, q]
            else:
                a[cq, cp] += small_a[p, q]


@kernel
def accumulate(r, jac, scale, weight, configuration, columns, loss, tuning, curved, first, cost, g, a, pull):
    """Adds whitened, weighted rows to the normal equations of the shared columns; cost is half the sum of rho.

    r (B, m, d), jac (B, m, d, k); scale (M, d) = 1 / sigma; weight (1 or B, U) per configuration (M,); rows first .. first + m of
    the (M,) arrays; curved (B,): whether the loss's curvature counts. r is whitened in place; pull (B, m) receives weight times slope
    of every row, for what else the rows touch, and jac is whitened too, as the matrix takes it; it may have no rows.
    """
    batch, m, d = r.shape
    k = jac.shape[3]
    lanes = (k + LANES) // LANES * LANES  # of the columns, and one of the residuals behind them
    small_a = np.zeros((lanes, lanes))
    small_g = np.zeros(k)
    wide = max(WIDE, d)
    heap = np.empty((lanes, wide))  # rows that wait to be multiplied, as columns
    for p in range(k + 1, lanes):
        for i in range(wide):
            heap[p, i] = 0.0
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
            if waiting + d > wide:
                products(heap, waiting, small_a)
                waiting = 0
            root = math.sqrt(w)
            if pull.shape[1] == 0 and not curved[b]:
                if d == 3:  # points, the ordinary case: the numbers of a column that lie together are written together
                    fx, fy, fz = root * scale[first + i, 0], root * scale[first + i, 1], root * scale[first + i, 2]
                    for p in range(k):
                        heap[p, waiting] = fx * jac[b, i, 0, p]
                        heap[p, waiting + 1] = fy * jac[b, i, 1, p]
                        heap[p, waiting + 2] = fz * jac[b, i, 2, p]
                else:
                    for c in range(d):
                        f = root * scale[first + i, c]
                        for p in range(k):
                            heap[p, waiting + c] = f * jac[b, i, c, p]
                for c in range(d):
                    heap[k, waiting + c] = root * r[b, i, c]
                waiting += d
                continue
            if pull.shape[1] > 0:
                pull[b, i] = w
            for c in range(d):
                f, row = scale[first + i, c], jac[b, i, c]
                wr = w * r[b, i, c]
                for p in range(k):
                    row[p] *= f
                    small_g[p] += wr * row[p]
            if curved[b]:  # of the matrix alone
                share = kept(loss, tuning, s)
                if share < 1.0:
                    shorten(jac[b, i], r[b, i], share)
            for c in range(d):
                row = jac[b, i, c]
                for p in range(k):
                    heap[p, waiting] = root * row[p]
                heap[k, waiting] = 0.0
                waiting += 1
        products(heap, waiting, small_a)
        for p in range(k):
            small_g[p] += small_a[k, p]
        add_shared_columns(columns, small_g, small_a, g[b], a[b])


@kernel
def accumulate_blocks(
    r, jac, jloc, cut, scale, pull, columns, local, other, pair, loss, tuning, curved, first, gl, al, asl, gm, am, asm, cross,
):  # fmt: skip
    """Adds what the same rows, as `accumulate` left them, say of local blocks: jloc (B, m, d, l + q), the first `cut` columns a
    block's of the first family; local, other, pair (M,) or -1. jloc is whitened in place."""
    batch, m, d = r.shape
    nl = jloc.shape[3]
    for b in range(batch):
        for i in range(m):
            w = pull[b, i]
            if w == 0.0:
                continue
            one, two, s = local[first + i], other[first + i], 0.0
            for c in range(d):
                f = scale[first + i, c]
                wr = w * r[b, i, c]
                s += r[b, i, c] * r[b, i, c]
                lrow = jloc[b, i, c]
                for p in range(nl):
                    lrow[p] *= f
                if one >= 0:
                    for p in range(cut):
                        gl[b, one, p] += wr * lrow[p]
                if two >= 0:
                    for p in range(cut, nl):
                        gm[b, two, p - cut] += wr * lrow[p]
            if curved[b]:
                share = kept(loss, tuning, s)
                if share < 1.0:
                    shorten(jloc[b, i], r[b, i], share)
            for c in range(d):
                row, lrow = jac[b, i, c], jloc[b, i, c]
                if one >= 0:
                    add_block(one, w, lrow[:cut], row, columns, al[b], asl[b])
                if two >= 0:
                    add_block(two, w, lrow[cut:], row, columns, am[b], asm[b])
                    if one >= 0:
                        both = cross[b, pair[first + i]]
                        for p in range(cut):
                            for q in range(cut, nl):
                                both[p, q - cut] += w * lrow[p] * lrow[q]
