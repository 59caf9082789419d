"""Compiled search for the point nearest to k = 0 in the polytope {k: lo <= base + N^T k <= hi}.

Exact: by projection on the interval or polygon when N has r = 1 or 2 rows, by the dual active-set method of Goldfarb
and Idnani (1983) beyond.
"""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.cables.balance._kernels import back_substitute, orthonormalise

# What a pose came to.
FOUND = 0
INFEASIBLE = 1
STUCK = 2  # iterations did not settle: never seen, never hidden

_EDGE = 1e-12  # how far outside its limits a tension may be by rounding, beside the largest limit


@kernel
def interval(base, e, count, lo, hi, edge):
    """The ends of {s: lo <= base + s e <= hi} for the first `count` cables, and whether it is there; limits that touch, up to
    rounding, leave one point."""
    low, high, steep_low, steep_high = -np.inf, np.inf, 0.0, 0.0
    for j in range(count):
        g, v = e[j], base[j]
        if abs(g) < 1e-13:
            if v < lo[j] - edge or v > hi[j] + edge:
                return 0.0, 0.0, False
            continue
        s0, s1 = (lo[j] - v) / g, (hi[j] - v) / g
        if s0 > s1:
            s0, s1 = s1, s0
        if s0 > low:
            low, steep_low = s0, abs(g)
        if s1 < high:
            high, steep_high = s1, abs(g)
    if low > high:  # the point that both limits miss by the same force
        share = steep_low / (steep_low + steep_high)
        if (low - high) * share * steep_high > edge:
            return 0.0, 0.0, False
        low = high = high + (low - high) * share
    return low, high, True


@kernel
def _on_polygon(base, n, lo, hi, edge, line, along, t):
    """Two rows of n: cables enter one by one; where one's limit cuts the point off, the new point lies on that limit."""
    m = base.shape[0]
    x, y = 0.0, 0.0
    for i in range(m):
        v = base[i] + n[0, i] * x + n[1, i] * y
        if v < lo[i] - edge:
            c = lo[i] - base[i]
        elif v > hi[i] + edge:
            c = hi[i] - base[i]
        else:
            continue
        square = n[0, i] * n[0, i] + n[1, i] * n[1, i]
        if square < 1e-26:
            return INFEASIBLE
        px, py = c * n[0, i] / square, c * n[1, i] / square
        inverse = 1.0 / math.sqrt(square)
        ex, ey = -n[1, i] * inverse, n[0, i] * inverse
        for j in range(i):
            line[j] = base[j] + n[0, j] * px + n[1, j] * py
            along[j] = n[0, j] * ex + n[1, j] * ey
        low, high, ok = interval(line, along, i, lo, hi, edge)
        if not ok:
            return INFEASIBLE
        s = min(max(0.0, low), high)
        x, y = px + s * ex, py + s * ey
    for i in range(m):
        t[i] = base[i] + n[0, i] * x + n[1, i] * y
    return FOUND


@kernel
def _orthogonalise(n, active, sign, count, q, tri):
    """q (count, r), tri <- the active limits' normals, orthonormal in the order in which they entered."""
    for a in range(count):
        for c in range(q.shape[1]):
            q[a, c] = sign[a] * n[c, active[a]]
    orthonormalise(q, tri, count)


@kernel
def _most_violated(base, n, r, x, lo, hi, edge):
    """Cable, side (+1 lower limit, -1 upper) and amount of the limit that x violates most; cable -1 for none."""
    worst, cable, side = edge, -1, 1.0
    for i in range(base.shape[0]):
        v = base[i]
        for c in range(r):
            v += n[c, i] * x[c]
        if lo[i] - v > worst:
            worst, cable, side = lo[i] - v, i, 1.0
        if v - hi[i] > worst:
            worst, cable, side = v - hi[i], i, -1.0
    return cable, side, worst


@kernel
def _on_limits(base, lo, hi, active, sign, count, q, tri, x, y):
    """x (r,) <- the point nearest to 0 on which the active limits hold exactly; y (count,) scratch."""
    x[:] = 0.0
    for a in range(count):
        bound = lo[active[a]] if sign[a] > 0.0 else hi[active[a]]
        s = sign[a] * (bound - base[active[a]])
        for j in range(a):
            s -= tri[j, a] * y[j]
        y[a] = s / tri[a, a]
        for c in range(x.shape[0]):
            x[c] += y[a] * q[a, c]


@kernel(inline=True)
def _split(q, tri, count, z, y):
    """z (r,) <- its part across the active normals, y (count,) <- the others' shares of it; returns |z|^2 after and before."""
    r = z.shape[0]
    full, rest = 0.0, 0.0
    for c in range(r):
        full += z[c] * z[c]
    for a in range(count):
        y[a] = 0.0
    for _ in range(2):
        for a in range(count):
            s = 0.0
            for c in range(r):
                s += q[a, c] * z[c]
            y[a] += s
            for c in range(r):
                z[c] -= s * q[a, c]
    for c in range(r):
        rest += z[c] * z[c]
    back_substitute(tri, count, y)
    return rest, full


@kernel(inline=True)
def _on_polytope(base, n, r, lo, hi, edge, t):
    """Any number of rows of n: dual active set (Goldfarb and Idnani 1983) with the identity for its Hessian."""
    m = base.shape[0]
    x, z, y = np.zeros(r), np.zeros(r), np.zeros(r + 1)
    q, tri = np.zeros((r + 1, r)), np.zeros((r + 1, r + 1))
    active, sign, u = np.zeros(r + 1, np.int64), np.zeros(r + 1), np.zeros(r + 1)
    count = 0
    for _ in range(50 * m):
        cable, side, gap = _most_violated(base, n, r, x, lo, hi, edge)
        if cable < 0:
            # Rounding of the many steps is not left in the answer.
            _orthogonalise(n, active, sign, count, q, tri)
            _on_limits(base, lo, hi, active, sign, count, q, tri, x, y)
            for i in range(m):
                t[i] = base[i]
                for c in range(r):
                    t[i] += n[c, i] * x[c]
            return FOUND
        entering = 0.0
        while True:
            _orthogonalise(n, active, sign, count, q, tri)
            for c in range(r):
                z[c] = side * n[c, cable]
            rest, full = _split(q, tri, count, z, y)
            step, leaving = np.inf, -1
            for a in range(count):
                if y[a] > 1e-12 and u[a] < step * y[a]:
                    step, leaving = u[a] / y[a], a
            free = rest > 1e-20 * full and count < r
            if free and gap / rest <= step:
                step, leaving = gap / rest, -1
            elif leaving < 0:
                return INFEASIBLE
            if free:
                for c in range(r):
                    x[c] += step * z[c]
                gap -= step * rest
            for a in range(count):
                u[a] -= step * y[a]
            entering += step
            if leaving < 0:
                active[count], sign[count], u[count] = cable, side, entering
                count += 1
                break
            count -= 1
            for a in range(leaving, count):
                active[a], sign[a], u[a] = active[a + 1], sign[a + 1], u[a + 1]
    return STUCK


@kernel
def nearest(base, n, r, lo, hi, edge, line, along, t):
    """t <- base + N^T k within the limits with the least |k|; N are the first r rows of n."""
    m = base.shape[0]
    code = FOUND
    if r == 0:
        for i in range(m):
            if not (base[i] >= lo[i] - edge and base[i] <= hi[i] + edge):
                return INFEASIBLE
            t[i] = base[i]
    elif r == 1:
        low, high, ok = interval(base, n[0], m, lo, hi, edge)
        if not ok:
            return INFEASIBLE
        s = min(max(0.0, low), high)
        for i in range(m):
            t[i] = base[i] + s * n[0, i]
    elif r == 2:
        code = _on_polygon(base, n, lo, hi, edge, line, along, t)
    else:
        code = _on_polytope(base, n, r, lo, hi, edge, t)
    if code == FOUND:
        for i in range(m):
            t[i] = min(max(t[i], lo[i]), hi[i])
    return code


@kernel
def edge_of(lo, hi):
    """The rounding allowed at a limit [N]."""
    top = 0.0
    for i in range(lo.shape[0]):
        top = max(top, abs(lo[i]), abs(hi[i]))
    return _EDGE * top
