"""Compiled distance between wrenches and the polytope of wrenches that cables within their limits can balance.

That polytope (a zonotope) is bounded by hyperplanes through d - 1 cable directions. The row of tensions n^T W of such a
hyperplane is zero for those cables, so it is a vector s on the other r + 1 with N s = 0, and n = (W^T)^+ s.
"""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.cables.balance._kernels import back_substitute, factor, null_rows, orthonormalise, reflect, solve

_PULL = 5e-14  # what rounding leaves of a pull that is none, beside the cable's own and the largest wrench


@kernel
def dependency(n, r, chosen, work, column, s):
    """s (r + 1,) <- a vector with sum_j N[:, chosen_j] s_j = 0; returns |s|^2, zero when there is more than one such line."""
    for i in range(r):
        for j in range(r + 1):
            work[i, j] = n[i, chosen[j]]
    for j in range(r + 1):
        column[j] = j
    for k in range(r):  # elimination with full pivoting; the column that is left is the free one
        best, pi, pj = 0.0, k, k
        for i in range(k, r):
            for j in range(k, r + 1):
                if abs(work[i, column[j]]) > best:
                    best, pi, pj = abs(work[i, column[j]]), i, j
        if best < 1e-12:
            return 0.0
        column[k], column[pj] = column[pj], column[k]
        for j in range(r + 1):
            work[k, j], work[pi, j] = work[pi, j], work[k, j]
        for i in range(k + 1, r):
            f = work[i, column[k]] / work[k, column[k]]
            for j in range(k, r + 1):
                work[i, column[j]] -= f * work[k, column[j]]
    s[column[r]] = 1.0
    size = 1.0
    for k in range(r - 1, -1, -1):
        v = 0.0
        for j in range(k + 1, r + 1):
            v -= work[k, column[j]] * s[column[j]]
        s[column[k]] = v / work[k, column[k]]
        size += s[column[k]] * s[column[k]]
    return size


@kernel(inline=True)
def _normals(h, diagonal, tau, rank, unit, out):
    """out (d, m), rows in the order of the pivots, <- (W^T)^+ = L^-T Q^T: a hyperplane's normal is n = out s."""
    d, m = h.shape
    for k in range(d):
        for j in range(m):
            unit[j] = 0.0
        unit[k] = 1.0
        reflect(h, tau, rank, unit)
        for j in range(m):
            out[k, j] = unit[j]
    for k in range(d - 1, -1, -1):  # L^T x = Q^T s, from below
        for j in range(m):
            v = out[k, j]
            for i in range(k + 1, d):
                v -= h[i, k] * out[i, j]
            out[k, j] = v / diagonal[k]


@kernel
def _projected(shape, order, inverse, out):
    """out (m, q) <- (shape^T (W^T)^+)^T: how far each disturbance reaches along a hyperplane's normal is |out^T s|."""
    d, m = inverse.shape
    for j in range(m):
        for c in range(shape.shape[1]):
            out[j, c] = 0.0
        for i in range(d):
            for c in range(shape.shape[1]):
                out[j, c] += shape[order[i], c] * inverse[i, j]


@kernel
def _room(top, bottom, x, size, gone, small):
    """y |y| for the greatest y that keeps x +- (sqrt(gone) + y sqrt(size)) between bottom and top: one root for all hyperplanes."""
    room = min(top - x, x - bottom)
    if gone > 0.0:
        room -= math.sqrt(gone)
    if size > small:
        return room * abs(room) / size
    return (
        -np.inf if room < -1e-9 * (top - bottom) else np.inf
    )  # no disturbance leads to this hyperplane, nor back over it


@kernel
def _peak(seen):
    """The greatest number, whatever its sign: numpy's own would be compiled for itself."""
    peak = 0.0
    for i in range(seen.shape[0]):
        for j in range(seen.shape[1]):
            peak = max(peak, abs(seen[i, j]))
    return peak


@kernel
def _reach3(seen, a, b, c, sa, sb, sc):
    """|shape^T n|^2 of the hyperplane of s = (sa, sb, sc) on the cables a, b, c."""
    size = 0.0
    for i in range(seen.shape[1]):
        x = sa * seen[a, i] + sb * seen[b, i] + sc * seen[c, i]
        size += x * x
    return size


@kernel(inline=True)
def _nearest3(n, seen, lost, t, lo, hi):
    """Least y |y| over all hyperplanes, for two redundant cables: each s is a cross product."""
    m = n.shape[1]
    least, peak = np.inf, 1e-13 * _peak(seen)
    for a in range(m):
        for b in range(a + 1, m):
            sc = n[0, a] * n[1, b] - n[0, b] * n[1, a]
            for c in range(b + 1, m):
                sa = n[0, b] * n[1, c] - n[0, c] * n[1, b]
                sb = n[0, c] * n[1, a] - n[0, a] * n[1, c]
                long = sa * sa + sb * sb + sc * sc
                if long <= 1e-24:
                    continue
                size, gone = _reach3(seen, a, b, c, sa, sb, sc), _reach3(lost, a, b, c, sa, sb, sc)
                top = max(sa * lo[a], sa * hi[a]) + max(sb * lo[b], sb * hi[b]) + max(sc * lo[c], sc * hi[c])
                bottom = min(sa * lo[a], sa * hi[a]) + min(sb * lo[b], sb * hi[b]) + min(sc * lo[c], sc * hi[c])
                for v in range(t.shape[0]):
                    x = sa * t[v, a] + sb * t[v, b] + sc * t[v, c]
                    least = min(least, _room(top, bottom, x, size, gone, peak * peak * long))
    return least


@kernel
def _reach(seen, r, chosen, s):
    """|shape^T n|^2 of the hyperplane of s."""
    size = 0.0
    for c in range(seen.shape[1]):
        x = 0.0
        for j in range(r + 1):
            x += seen[chosen[j], c] * s[j]
        size += x * x
    return size


@kernel(inline=True)
def _nearest(n, r, seen, lost, t, lo, hi, chosen, column, s, work):
    """Least y |y| over all hyperplanes, for any number of redundant cables."""
    m = n.shape[1]
    least, peak = np.inf, 1e-13 * _peak(seen)
    for j in range(r + 1):
        chosen[j] = j
    while True:
        long = dependency(n, r, chosen, work, column, s)
        if long > 0.0:
            top, bottom = 0.0, 0.0
            for j in range(r + 1):
                a, b = s[j] * lo[chosen[j]], s[j] * hi[chosen[j]]
                top += max(a, b)
                bottom += min(a, b)
            size, gone = _reach(seen, r, chosen, s), _reach(lost, r, chosen, s)
            for v in range(t.shape[0]):
                x = 0.0
                for j in range(r + 1):
                    x += s[j] * t[v, chosen[j]]
                least = min(least, _room(top, bottom, x, size, gone, peak * peak * long))
        j = r
        while j >= 0 and chosen[j] == m - r - 1 + j:
            j -= 1
        if j < 0:
            return least
        chosen[j] += 1
        for i in range(j + 1, r + 1):
            chosen[i] = chosen[i - 1] + 1


@kernel
def margin_kernel(w, load, shape, taken, lo, hi, margin, code):
    """margin (k,) <- greatest x with load + taken f + shape e balanced for all |f| <= 1, |e| <= x, over load (k, v, d); negative:
    not balanced.

    shape (k or 1, d, q), taken (k or 1, d, p). code 1: W has not full rank.
    """
    count, d, m = w.shape
    many, width, often = shape.shape[0], shape.shape[2], taken.shape[0]
    h, n, inverse = np.empty((d, m)), np.empty((m, m)), np.empty((d, m))
    seen, lost = np.empty((m, width)), np.empty((m, taken.shape[2]))
    diagonal, tau, order = np.empty(d), np.empty(d), np.empty(d, np.int64)
    r = m - d
    loads = load.shape[1]
    t, unit = np.empty((loads, m)), np.empty(m)
    chosen, column, s, work = (
        np.empty(r + 1, np.int64),
        np.empty(r + 1, np.int64),
        np.empty(r + 1),
        np.empty((r + 1, r + 1)),
    )
    for k in range(count):
        for i in range(d):
            for j in range(m):
                h[i, j] = w[k, i, j]
        if factor(h, diagonal, tau, order) < d:
            code[k] = 1
            continue
        code[k] = 0
        for v in range(loads):
            solve(h, diagonal, tau, order, d, load[k, v], 0.0, t[v])
        null_rows(h, tau, d, n)
        _normals(h, diagonal, tau, d, unit, inverse)
        _projected(shape[k if many > 1 else 0], order, inverse, seen)
        _projected(taken[k if often > 1 else 0], order, inverse, lost)
        if r == 2:
            least = _nearest3(n, seen, lost, t, lo, hi)
        else:
            least = _nearest(n, r, seen, lost, t, lo, hi, chosen, column, s, work)
        margin[k] = math.copysign(math.sqrt(abs(least)), least)


@kernel
def _free_step(a, b, free, count, q, tri, y):
    """y (count,) <- least-squares solution of the free columns of a for b."""
    d = a.shape[0]
    for c in range(count):
        for i in range(d):
            q[c, i] = a[i, free[c]]
    orthonormalise(q, tri, count)
    for c in range(count):
        y[c] = 0.0
        for i in range(d):
            y[c] += q[c, i] * b[i]
    back_substitute(tri, count, y)


@kernel
def _first_limit(t, y, free, count, lo, hi):
    """The share of the way from the tensions t of the free cables to y (count,) that the limits leave, the cable that ends it
    (-1: none) and the side of its limit."""
    step, leaving, side = 1.0, -1, 0
    for c in range(count):
        j = free[c]
        if y[c] < lo[j] and (lo[j] - t[j]) / (y[c] - t[j]) < step:
            step, leaving, side = (lo[j] - t[j]) / (y[c] - t[j]), j, -1
        elif y[c] > hi[j] and (hi[j] - t[j]) / (y[c] - t[j]) < step:
            step, leaving, side = (hi[j] - t[j]) / (y[c] - t[j]), j, 1
    return step, leaving, side


@kernel
def missing_kernel(w, load, weight, lo, hi, missing, code):
    """missing (k, d) <- -(W t + w) of the t within limits that makes it shortest (Lawson and Hanson's active set, both limits)."""
    count, d, m = w.shape
    a, b, rest = np.empty((d, m)), np.empty(d), np.empty(d)
    q, tri, y = np.empty((m, d)), np.empty((m, m)), np.empty(m)
    t, state, free, long = np.empty(m), np.empty(m, np.int64), np.empty(m, np.int64), np.empty(m)
    for k in range(count):
        size = 0.0
        for i in range(d):
            size = max(size, abs(weight[i] * load[k, i]))
            for j in range(m):
                a[i, j] = weight[i] * w[k, i, j]
        for j in range(m):
            t[j], state[j] = lo[j], -1  # -1 at the lower limit, 1 at the upper one, 0 free
            long[j] = 0.0
            for i in range(d):
                long[j] += a[i, j] * a[i, j]
            long[j] = math.sqrt(long[j])
            size = max(size, long[j] * max(abs(lo[j]), abs(hi[j])))
        code[k] = 1
        for _ in range(100 * m):
            for i in range(d):
                rest[i] = -weight[i] * load[k, i]
                for j in range(m):
                    rest[i] -= a[i, j] * t[j]
            best, pick = 0.0, -1
            for j in range(m):
                if state[j] != 0:
                    pull = 0.0
                    for i in range(d):
                        pull += a[i, j] * rest[i]
                    pull *= -state[j]
                    if pull > max(best, _PULL * long[j] * size) and hi[j] > lo[j]:
                        best, pick = pull, j
            if pick < 0:
                code[k] = 0
                break
            state[pick] = 0
            while True:
                number = 0
                for i in range(d):
                    b[i] = -weight[i] * load[k, i]
                for j in range(m):
                    if state[j] == 0:
                        free[number] = j
                        number += 1
                    else:
                        for i in range(d):
                            b[i] -= a[i, j] * t[j]
                if number == 0:
                    break
                _free_step(a, b, free, number, q, tri, y)
                step, leaving, side = _first_limit(t, y, free, number, lo, hi)
                for c in range(number):
                    t[free[c]] += step * (y[c] - t[free[c]])
                if leaving < 0:
                    break
                t[leaving], state[leaving] = lo[leaving] if side < 0 else hi[leaving], side
        for i in range(d):
            missing[k, i] = rest[i] / weight[i]
