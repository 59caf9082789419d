"""Compiled choices among the tensions within limits that balance a wrench, pose by pose."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.cables.balance._kernels import factor, null_rows, solve
from robocal.cables.polytope._kernels import FOUND, INFEASIBLE, STUCK, edge_of, interval, nearest


@kernel
def nearest_kernel(w, load, lo, hi, reference, tension, code):
    """tension (k, m) <- those within the limits that are nearest to `reference` (m,); code (k,) <- FOUND or not."""
    count, d, m = w.shape
    h, n = np.empty((d, m)), np.empty((m, m))
    diagonal, tau, order = np.empty(d), np.empty(d), np.empty(d, np.int64)
    base, line, along = np.empty(m), np.empty(m), np.empty(m)
    edge = edge_of(lo, hi)
    shifted = False
    for i in range(m):
        shifted = shifted or reference[i] != 0.0
    for k in range(count):
        for i in range(d):
            for j in range(m):
                h[i, j] = w[k, i, j]
        rank = factor(h, diagonal, tau, order)
        if not solve(h, diagonal, tau, order, rank, load[k], 100.0 * edge, base):
            code[k] = INFEASIBLE
            continue
        null_rows(h, tau, rank, n)
        if shifted:
            for c in range(m - rank):
                s = 0.0
                for i in range(m):
                    s += n[c, i] * reference[i]
                for i in range(m):
                    base[i] += s * n[c, i]
        code[k] = nearest(base, n, m - rank, lo, hi, edge, line, along, tension[k])


@kernel
def _clip(px, py, count, nx, ny, bound, qx, qy):
    """Corners of the convex polygon p (first `count`) that lies in nx x + ny y >= bound, into q; returns their number."""
    made = 0
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        here, there = nx * px[i] + ny * py[i] - bound, nx * px[j] + ny * py[j] - bound
        if here >= 0.0:
            qx[made], qy[made] = px[i], py[i]
            made += 1
        if (here > 0.0 and there < 0.0) or (here < 0.0 and there > 0.0):
            s = here / (here - there)
            qx[made], qy[made] = px[i] + s * (px[j] - px[i]), py[i] + s * (py[j] - py[i])
            made += 1
    return made


@kernel
def _polygon(base, n, lo, hi, px, py, qx, qy):
    """Corners of {(x, y): lo <= base + n^T (x, y) <= hi} in order, into p: a parallelogram cut by one half-plane after another."""
    m = base.shape[0]
    best, a, b = 0.0, 0, 1
    for i in range(m):
        for j in range(i + 1, m):
            det = abs(n[0, i] * n[1, j] - n[0, j] * n[1, i])
            if det > best:
                best, a, b = det, i, j
    det = n[0, a] * n[1, b] - n[0, b] * n[1, a]
    for corner in range(4):
        u = (hi[a] if corner == 1 or corner == 2 else lo[a]) - base[a]
        v = (hi[b] if corner >= 2 else lo[b]) - base[b]
        px[corner], py[corner] = (u * n[1, b] - v * n[1, a]) / det, (v * n[0, a] - u * n[0, b]) / det
    count = 4
    for i in range(m):
        if i != a and i != b:
            count = _clip(px, py, count, n[0, i], n[1, i], lo[i] - base[i], qx, qy)
            count = _clip(qx, qy, count, -n[0, i], -n[1, i], base[i] - hi[i], px, py)
    return count


@kernel
def _centroid(px, py, count):
    """Centre of area of a convex polygon; the middle of its corners' box where it has no area."""
    area, x, y, reach = 0.0, 0.0, 0.0, 0.0
    for i in range(1, count - 1):
        ax, ay = px[i] - px[0], py[i] - py[0]
        bx, by = px[i + 1] - px[0], py[i + 1] - py[0]
        cross = ax * by - ay * bx
        area += cross
        x += cross * (ax + bx)
        y += cross * (ay + by)
        reach = max(reach, ax * ax + ay * ay, bx * bx + by * by)
    if abs(area) > 1e-14 * reach:
        return px[0] + x / (3.0 * area), py[0] + y / (3.0 * area)
    return 0.5 * (px[:count].min() + px[:count].max()), 0.5 * (py[:count].min() + py[:count].max())


@kernel
def _middle(base, n, t, lo, hi, edge, along, px, py, qx, qy):
    """Centre (x, y) of the polygon, of which t is some point; a cable whose limits are equal leaves a segment of it."""
    m = base.shape[0]
    steep, held = 1e-26, -1
    for i in range(m):
        square = n[0, i] * n[0, i] + n[1, i] * n[1, i]
        if hi[i] - lo[i] <= edge and square > steep:
            steep, held = square, i
    x, y = 0.0, 0.0
    corners = 0 if held >= 0 else _polygon(base, n, lo, hi, px, py, qx, qy)
    if corners > 0:
        return _centroid(px, py, corners)
    for i in range(m):
        x += n[0, i] * (t[i] - base[i])
        y += n[1, i] * (t[i] - base[i])
    if held >= 0:
        ex, ey = -n[1, held] / math.sqrt(steep), n[0, held] / math.sqrt(steep)
        for i in range(m):
            along[i] = n[0, i] * ex + n[1, i] * ey
        along[held] = 0.0
        low, high, ok = interval(t, along, m, lo, hi, edge)
        if ok:
            x, y = x + 0.5 * (low + high) * ex, y + 0.5 * (low + high) * ey
    return x, y  # the only point where rounding has lost the polygon


@kernel
def centre_kernel(w, load, lo, hi, tension, code, redundancy):
    """tension (k, m) <- centre of area of the polygon of tensions (middle of the interval, the only point) within the limits.

    code FOUND or INFEASIBLE; redundancy (k,) <- m - rank; a pose with more than two redundant cables gets FOUND and no centre.
    """
    count, d, m = w.shape
    h, n = np.empty((d, m)), np.empty((m, m))
    diagonal, tau, order = np.empty(d), np.empty(d), np.empty(d, np.int64)
    base, line, along, t = np.empty(m), np.empty(m), np.empty(m), np.empty(m)
    px, py, qx, qy = np.empty(2 * m + 8), np.empty(2 * m + 8), np.empty(2 * m + 8), np.empty(2 * m + 8)
    edge = edge_of(lo, hi)
    for k in range(count):
        for i in range(d):
            for j in range(m):
                h[i, j] = w[k, i, j]
        rank = factor(h, diagonal, tau, order)
        r = m - rank
        redundancy[k] = r
        if not solve(h, diagonal, tau, order, rank, load[k], 100.0 * edge, base):
            code[k] = INFEASIBLE
            continue
        null_rows(h, tau, rank, n)
        # Whether there is a polygon at all is asked once, of the routine that every method asks.
        code[k] = nearest(base, n, r, lo, hi, edge, line, along, t)
        if code[k] != FOUND:
            continue
        x, y = 0.0, 0.0
        if r == 1:
            low, high, _ = interval(base, n[0], m, lo, hi, edge)
            x = 0.5 * (low + high)
        elif r == 2:
            x, y = _middle(base, n, t, lo, hi, edge, along, px, py, qx, qy)
        for i in range(m):
            v = base[i]
            if r >= 1:
                v += n[0, i] * x
            if r == 2:
                v += n[1, i] * y
            tension[k, i] = min(max(v, lo[i]), hi[i])


@kernel
def _cholesky(a, r):
    for i in range(r):
        for j in range(i + 1):
            s = a[i, j]
            for c in range(j):
                s -= a[i, c] * a[j, c]
            a[i, j] = math.sqrt(s) if i == j else s / a[j, j]


@kernel
def _newton_target(t, n, r, reference, scale, power, damping, hess, grad, g, base):
    """Newton's step for sum |(t - reference) / scale|^power in the null space, as a nearest-point problem: base and rows g.

    With H = L L^T the step minimises |y| over base + g^T y, where g = L^-1 N and base = t - g^T L^-1 N f'(t).
    """
    m = t.shape[0]
    trace = 0.0
    for c in range(r):
        grad[c] = 0.0
        for e in range(c + 1):
            hess[c, e] = 0.0
    for i in range(m):
        x = (t[i] - reference) / scale
        slope = power * math.copysign(abs(x) ** (power - 1.0), x) / scale
        bend = power * (power - 1.0) * abs(x) ** (power - 2.0) / (scale * scale)
        for c in range(r):
            grad[c] += n[c, i] * slope
            for e in range(c + 1):
                hess[c, e] += n[c, i] * n[e, i] * bend
    for c in range(r):
        trace += hess[c, c]
    for c in range(r):
        hess[c, c] += damping * trace + 1e-300
    _cholesky(hess, r)
    for c in range(r):
        for e in range(c):
            grad[c] -= hess[c, e] * grad[e]
        grad[c] /= hess[c, c]
        for i in range(m):
            s = n[c, i]
            for e in range(c):
                s -= hess[c, e] * g[e, i]
            g[c, i] = s / hess[c, c]
    for i in range(m):
        base[i] = t[i]
        for c in range(r):
            base[i] -= g[c, i] * grad[c]


@kernel
def _power_sum(t, reference, scale, power):
    s = 0.0
    for i in range(t.shape[0]):
        s += abs((t[i] - reference) / scale) ** power
    return s


@kernel
def _balanced(step, t, n, r, lo, hi, edge, share):
    """step <- what of the way from t to `step` changes no wrench: high powers leave the search few digits. Returns how much of
    it stays within the limits, at most 1."""
    for c in range(r):
        share[c] = 0.0
        for i in range(t.shape[0]):
            share[c] += n[c, i] * (step[i] - t[i])
    most = 1.0
    for i in range(t.shape[0]):
        step[i] = 0.0
        for c in range(r):
            step[i] += n[c, i] * share[c]
        if t[i] + step[i] > hi[i] + edge:
            most = min(most, max((hi[i] + edge - t[i]) / step[i], 0.0))
        elif t[i] + step[i] < lo[i] - edge:
            most = min(most, max((lo[i] - edge - t[i]) / step[i], 0.0))
    return most


@kernel
def _descend(t, n, r, lo, hi, edge, reference, scale, power, hess, grad, g, base, line, along, trial):
    """t <- where the sum of powers is least, by Newton's steps from t; each is exact within the limits. FOUND or STUCK."""
    value, gain = _power_sum(t, reference, scale, power), np.inf
    damping = 1e-12
    for _ in range(200):
        _newton_target(t, n, r, reference, scale, power, damping, hess, grad, g, base)
        if nearest(base, g, r, lo, hi, edge, line, along, trial) != FOUND:
            damping *= 100.0  # t itself is within the limits: a step that is not found lost its digits
            continue
        change, share, new = 0.0, _balanced(trial, t, n, r, lo, hi, edge, grad), value
        for i in range(t.shape[0]):
            change = max(change, abs(trial[i]))
        if change <= 1e-11 * scale:
            return FOUND
        while share > 1e-9:
            for i in range(t.shape[0]):
                line[i] = min(max(t[i] + share * trial[i], lo[i]), hi[i])
            new = _power_sum(line, reference, scale, power)
            if new < value:
                break
            share *= 0.5
        if share <= 1e-9:  # no better point in this direction: the value is flat to rounding
            return FOUND
        gain, value = value - new, new
        for i in range(t.shape[0]):
            t[i] = line[i]
    return FOUND if gain <= 1e-10 * value else STUCK  # cables whose powers count for nothing crawl on


@kernel
def power_kernel(w, load, lo, hi, reference, power, tension, code):
    """tension (k, m) <- those within the limits with the least sum |t - reference|^power.

    From the shortest ones (power 2) the power is doubled until it is reached, and tensions are measured by the greatest
    of them: high powers of others vanish, and Newton's steps from afar are short.
    """
    count, d, m = w.shape
    h, n, g = np.empty((d, m)), np.empty((m, m)), np.empty((m, m))
    diagonal, tau, order = np.empty(d), np.empty(d), np.empty(d, np.int64)
    base, line, along, t = np.empty(m), np.empty(m), np.empty(m), np.empty(m)
    hess, grad, trial = np.empty((m, m)), np.empty(m), np.empty(m)
    edge = edge_of(lo, hi)
    for k in range(count):
        for i in range(d):
            for j in range(m):
                h[i, j] = w[k, i, j]
        rank = factor(h, diagonal, tau, order)
        r = m - rank
        if not solve(h, diagonal, tau, order, rank, load[k], 100.0 * edge, base):
            code[k] = INFEASIBLE
            continue
        null_rows(h, tau, rank, n)
        code[k] = nearest(base, n, r, lo, hi, edge, line, along, t)
        reached = 2.0
        while code[k] == FOUND and reached < power:
            reached = min(2.0 * reached, power)
            scale = 0.0
            for i in range(m):
                scale = max(scale, abs(t[i] - reference))
            if scale <= edge:
                break
            code[k] = _descend(
                t, n, r, lo, hi, edge, reference, scale, reached, hess, grad, g, base, line, along, trial
            )
        for i in range(m):
            tension[k, i] = t[i]
