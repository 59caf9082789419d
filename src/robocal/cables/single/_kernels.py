"""Compiled statics and kinematics of one pose, for loops that cannot wait: nothing is raised, codes say how it ended."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.cables.balance._kernels import length_of
from robocal.cables.distribution._kernels import centre_kernel, nearest_kernel, power_kernel
from robocal.cables.polytope._kernels import FOUND, INFEASIBLE
from robocal.estimate._kernels import backward, cholesky, forward
from robocal.geometry._kernels import rotation_from_vector

NEAREST, CLOSED, CENTRE, POWER = 0, 1, 2, 3  # methods of a distribution
FAR = 1e100  # N: no limit
EDGE = 1e-12  # of the greatest limit
SETTLED, UNSETTLED, LOST = 0, 1, 2  # of a search for a pose
ITERATIONS = 200
POLISH, FAINT, NEAR, ENOUGH = 20, 1e-12, 1e-6, 1e-14  # as `cables.forward`
SHORTEST = 1e-9  # m; a direction made of rounding is none
RIGID = 1e-6  # how far axes may be from orthonormal: what is left of poses that were printed with seven digits


@kernel
def rigid(pose):
    """Whether a pose (4, 4) is a rigid motion: orthonormal axes of determinant 1, last row 0 0 0 1. A number that is none is not."""
    for i in range(3):
        for k in range(i, 3):
            s = pose[0, i] * pose[0, k] + pose[1, i] * pose[1, k] + pose[2, i] * pose[2, k] - (1.0 if i == k else 0.0)
            if not abs(s) <= RIGID:
                return False
        if not (abs(pose[3, i]) <= RIGID and math.isfinite(pose[i, 3])):
            return False
    x = pose[1, 1] * pose[2, 2] - pose[1, 2] * pose[2, 1]
    y = pose[1, 2] * pose[2, 0] - pose[1, 0] * pose[2, 2]
    z = pose[1, 0] * pose[2, 1] - pose[1, 1] * pose[2, 0]
    return abs(pose[3, 3] - 1.0) <= RIGID and pose[0, 0] * x + pose[0, 1] * y + pose[0, 2] * z > 0.0


@kernel
def slopes(pose, cables, full, slope):
    """full (m,) <- lengths without zeros at a pose (4, 4), slope (m, 6) <- their gradient by (v, w); cables (p, 14) are the segments of
    `cable_table`, the first m of them those of each cable's own."""
    u, m = np.empty(3), full.shape[0]
    for i in range(cables.shape[0]):
        bx, by, bz = cables[i, 3], cables[i, 4], cables[i, 5]
        lx = pose[0, 0] * bx + pose[0, 1] * by + pose[0, 2] * bz
        ly = pose[1, 0] * bx + pose[1, 1] * by + pose[1, 2] * bz
        lz = pose[2, 0] * bx + pose[2, 1] * by + pose[2, 2] * bz
        dx, dy, dz = pose[0, 3] + lx - cables[i, 0], pose[1, 3] + ly - cables[i, 1], pose[2, 3] + lz - cables[i, 2]
        if cables[i, 13] != 0.0:
            dx, dy, dz = bx - cables[i, 0], by - cables[i, 1], bz - cables[i, 2]
        f = length_of(dx, dy, dz, cables[i, 7], cables[i, 8:11], u)
        if cables[i, 13] != 0.0:
            u[:] = 0.0
        n, c = cables[i, 12], i if i < m else int(cables[i, 11])
        if i < m:
            full[c] = 0.0
            for o in range(6):
                slope[c, o] = 0.0
        ux, uy, uz = n * u[0], n * u[1], n * u[2]
        full[c] += n * f
        slope[c, 0] += ux
        slope[c, 1] += uy
        slope[c, 2] += uz
        slope[c, 3] += ly * uz - lz * uy
        slope[c, 4] += lz * ux - lx * uz
        slope[c, 5] += lx * uy - ly * ux


@kernel
def held(pose, wrench, cables, rows, body, bounds, method, power, tension):
    """tension (m,) <- those within the limits that hold the weight body (4,), newtons and centre, and a wrench (6,) on top at a pose
    (4, 4), by a method; bounds (3, m) are least, greatest and reference, rows (d,) the freedoms. FOUND, INFEASIBLE or STUCK."""
    m, d = bounds.shape[1], rows.shape[0]
    if not rigid(pose):
        tension[:] = math.nan
        return INFEASIBLE
    full, slope, w, load = np.empty(m), np.empty((m, 6)), np.empty((1, d, m)), np.empty((1, d))
    slopes(pose, cables, full, slope)
    total = np.empty(6)
    cx = pose[0, 0] * body[1] + pose[0, 1] * body[2] + pose[0, 2] * body[3]
    cy = pose[1, 0] * body[1] + pose[1, 1] * body[2] + pose[1, 2] * body[3]
    total[0], total[1], total[2] = wrench[0], wrench[1], wrench[2] - body[0]
    total[3], total[4], total[5] = wrench[3] - cy * body[0], wrench[4] + cx * body[0], wrench[5]
    for i in range(d):
        load[0, i] = total[rows[i]]
        if not math.isfinite(load[0, i]):
            tension[:] = math.nan
            return INFEASIBLE
        for j in range(m):
            w[0, i, j] = -slope[j, rows[i]]
            if not (full[j] > SHORTEST and math.isfinite(w[0, i, j])):
                tension[:] = math.nan
                return INFEASIBLE
    return choose(w, load, bounds, method, power, tension)


@kernel
def choose(w, load, bounds, method, power, tension):
    """tension (m,) <- those within bounds (3, m) that balance a load (1, d) with a structure (1, d, m), by a method; FOUND or not."""
    m = bounds.shape[1]
    out, code, lo, hi = np.empty((1, m)), np.empty(1, np.int64), bounds[0], bounds[1]
    if method == CENTRE:
        redundancy = np.empty(1, np.int64)
        centre_kernel(w, load, lo, hi, out, code, redundancy)
    elif method == POWER:
        power_kernel(w, load, lo, hi, 0.0, power, out, code)
    elif method == CLOSED:
        nearest_kernel(w, load, lo, hi, lo, out, code)  # whether there are any
        if code[0] == FOUND:
            nearest_kernel(w, load, np.full(m, -FAR), np.full(m, FAR), bounds[2], out, code)
            edge = EDGE * np.abs(bounds[:2]).max()
            for i in range(m):
                if not lo[i] - edge <= out[0, i] <= hi[i] + edge:
                    code[0] = INFEASIBLE
    else:
        nearest_kernel(w, load, lo, hi, bounds[2], out, code)
    for i in range(m):
        tension[i] = out[0, i] if code[0] == FOUND else math.nan
    return code[0]


@kernel
def left(pose, lengths, cables, rows, weight, r, j):
    """r (m,) <- lengths at a pose less those that were read, j (m, d) <- their gradient, both times weight (m,); half a sum of squares
    is not taken."""
    slope = np.empty((r.shape[0], 6))
    slopes(pose, cables, r, slope)
    cost = 0.0
    for i in range(r.shape[0]):
        r[i] = (r[i] - cables[i, 6] - lengths[i]) * weight[i]
        cost += r[i] * r[i]
        for c in range(rows.shape[0]):
            j[i, c] = slope[i, rows[c]] * weight[i]
    return cost


@kernel
def squares(j, r, a, g):
    """a (d, d), lower triangle, <- j^T j and g (d,) <- j^T r."""
    m, d = j.shape
    for c in range(d):
        s = 0.0
        for i in range(m):
            s += j[i, c] * r[i]
        g[c] = s
        for e in range(c + 1):
            s = 0.0
            for i in range(m):
                s += j[i, c] * j[i, e]
            a[c, e] = s


@kernel
def moved(pose, rows, step, turn, out):
    """out (4, 4) <- p + v, exp(w) R for the components `rows` of a twist."""
    twist = np.zeros(6)
    for c in range(rows.shape[0]):
        twist[rows[c]] = step[c]
    rotation_from_vector(twist[3], twist[4], twist[5], turn)
    for i in range(3):
        out[i, 3] = pose[i, 3] + twist[i]
        for k in range(3):
            out[i, k] = turn[i, 0] * pose[0, k] + turn[i, 1] * pose[1, k] + turn[i, 2] * pose[2, k]
    out[3, 0], out[3, 1], out[3, 2], out[3, 3] = 0.0, 0.0, 0.0, 1.0


@kernel
def put(source, out):
    """out (n, m) <- source (n, m): numba's own way brings half of its library with it, for its message on shapes that differ."""
    for i in range(out.shape[0]):
        for k in range(out.shape[1]):
            out[i, k] = source[i, k]


@kernel
def search(lengths, cables, rows, weight, pose, r, j):
    """pose (4, 4) <- where lengths (m,) place the platform, from where it is, by the descent of `cables.forward`; r (m,) and j (m, d)
    are what `left` says there. What is left, how it ended (SETTLED, UNSETTLED or LOST) and the number of iterations."""
    m, d = lengths.shape[0], rows.shape[0]
    new_j, new_r = np.empty((m, d)), np.empty(m)
    a, low, g, step, turn, trial = (
        np.empty((d, d)),
        np.empty((d, d)),
        np.empty(d),
        np.empty(d),
        np.empty((3, 3)),
        np.empty((4, 4)),
    )
    cost = left(pose, lengths, cables, rows, weight, r, j)
    lam, grow, code, count = 1e-4, 2.0, UNSETTLED, 0
    if not math.isfinite(cost):
        code = LOST
    while code == UNSETTLED and count < ITERATIONS and lam <= 1e12:
        count += 1
        squares(j, r, a, g)
        trace = 0.0
        for c in range(d):
            trace += a[c, c]
        for c in range(d):
            for e in range(c):
                low[c, e] = a[c, e]
            low[c, c] = a[c, c] + lam * max(a[c, c], 1e-9 * trace)
            step[c] = -g[c]
        if not cholesky(low, d):
            code = LOST
            break
        forward(low, d, step)
        backward(low, d, step)
        promised, most, far = 0.0, 0.0, 0.0
        for c in range(d):
            promised += lam * step[c] * step[c] * max(a[c, c], 1e-9 * trace) - step[c] * g[c]
            most = max(most, abs(step[c]))
        for i in range(3):
            far = max(far, abs(pose[i, 3]))
        moved(pose, rows, step, turn, trial)
        new = left(trial, lengths, cables, rows, weight, new_r, new_j)
        better = new < cost
        settled = most < 1e-13 * (1.0 + far) or (not better and promised <= 1e-14 * cost + 1e-32)
        if better:
            gain = (cost - new) / promised if promised > 0.0 else 0.0
            put(trial, pose)
            put(new_j, j)
            for i in range(m):
                r[i] = new_r[i]
            cost = new
            lam *= max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3)
            grow = 2.0
        else:
            lam *= grow
            grow *= 2.0
        if settled:
            code = SETTLED
    for _ in range(POLISH if code == SETTLED else 0):
        squares(j, r, a, g)
        trace, most = 0.0, 0.0
        for c in range(d):
            trace += a[c, c]
        for c in range(d):
            for e in range(c):
                low[c, e] = a[c, e]
            low[c, c] = a[c, c] + FAINT * max(a[c, c], 1e-9 * trace)
            step[c] = -g[c]
        if not cholesky(low, d):
            break
        forward(low, d, step)
        backward(low, d, step)
        for c in range(d):
            most = max(most, abs(step[c]))
        if not most < NEAR:
            break
        moved(pose, rows, step, turn, trial)
        put(trial, pose)
        cost = left(pose, lengths, cables, rows, weight, r, j)
        if most <= ENOUGH:
            break
    return cost, code, count


@kernel
def search_many(lengths, which, cables, rows, weight, pose, r, j, cost, code, count):
    """The same of poses (n, 4, 4), each for the lengths (k, m) of its row `which` (n,)."""
    for i in range(pose.shape[0]):
        cost[i], code[i], count[i] = search(lengths[which[i]], cables, rows, weight, pose[i], r[i], j[i])


@kernel
def placed(lengths, start, cables, rows, sigma, pose, r, covariance):
    """pose (4, 4) <- what `search` finds from a start (4, 4); r (m,) residuals, covariance (d, d) by sigma, or by what is left where that
    is nought. SETTLED, UNSETTLED or LOST, and the number of iterations."""
    m, d = lengths.shape[0], rows.shape[0]
    j, a, low, g, step = np.empty((m, d)), np.empty((d, d)), np.empty((d, d)), np.empty(d), np.empty(d)
    put(start, pose)
    cost, code, count = 0.0, LOST, 0
    if rigid(start):
        cost, code, count = search(lengths, cables, rows, np.ones(m), pose, r, j)
    if code == LOST:
        pose[:], r[:], covariance[:] = math.nan, math.nan, math.nan
        return code, count
    squares(j, r, a, g)
    scale = sigma * sigma
    if sigma == 0.0:
        scale = cost / (m - d) if m > d else math.nan
    spread(a, low, step, scale, covariance)
    return code, count


@kernel
def spread(a, low, column, scale, out):
    """out (d, d) <- `scale` times the inverse of a, lower triangle; not numbers where it has none."""
    d = a.shape[0]
    for c in range(d):
        for e in range(c + 1):
            low[c, e] = a[c, e]
    if not cholesky(low, d):
        out[:] = math.nan
        return
    for c in range(d):
        column[:] = 0.0
        column[c] = scale
        forward(low, d, column)
        backward(low, d, column)
        for e in range(d):
            out[e, c] = column[e]


@kernel
def turned(pose, rates, cables, rows, twist):
    """twist (6,) <- the velocity (v, w) with which cables lengthen by rates (m,) at a pose, in the sense of least squares."""
    m, d = rates.shape[0], rows.shape[0]
    full, slope, j, a, g = np.empty(m), np.empty((m, 6)), np.empty((m, d)), np.empty((d, d)), np.empty(d)
    slopes(pose, cables, full, slope)
    for i in range(m):
        for c in range(d):
            j[i, c] = slope[i, rows[c]]
    squares(j, rates, a, g)
    twist[:] = 0.0
    good = rigid(pose) and cholesky(a, d)
    if good:
        forward(a, d, g)
        backward(a, d, g)
    for c in range(d):
        twist[rows[c]] = g[c] if good and math.isfinite(g[c]) else math.nan
    return good
