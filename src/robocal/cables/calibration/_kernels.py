"""Compiled fits of one cable after the other: a start from the squared equations, then Levenberg-Marquardt."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.estimate._kernels import backward, cholesky, forward

LENGTH, SQUARED = 0, 1  # residuals: f |s - a| - (y + l0), and the squares of both; f is what stretch leaves of a length
SETTLED, DEGENERATE, LOST = 0, 1, 2
FLAT = 1e-11  # of the largest pivot: where the points of a list leave a direction open
ITERATIONS = 60
SMALL = 1e-20  # of the squared readings: the decrease from which a step is the last one
SHRINK, RAISE = 0.1, 10.0
TINY = 1e-300  # m


@kernel
def attached(t, b, out):
    """out (U, 3) <- where a platform anchor b (3,) is at poses t (U, 4, 4)."""
    for u in range(t.shape[0]):
        for i in range(3):
            out[u, i] = t[u, i, 0] * b[0] + t[u, i, 1] * b[1] + t[u, i, 2] * b[2] + t[u, i, 3]


@kernel
def centred(s, y, weight, a, g):
    """The normal equations of `squared_start` in space: what the compiler knows to be four numbers takes a third of the time. False
    where nothing was read."""
    total, mx, my, mz, ml, right = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for u in range(s.shape[0]):
        w, x, z = weight[u], s[u, 0], s[u, 2]
        total, mx, my, mz, ml = total + w, mx + w * x, my + w * s[u, 1], mz + w * z, ml + w * y[u]
        right += w * (x * x + s[u, 1] * s[u, 1] + z * z - y[u] * y[u])
    if total == 0.0:
        return False
    mx, my, mz, ml, right = mx / total, my / total, mz / total, ml / total, right / total
    xx, xy, yy, xz, yz, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    xl, yl, zl, ll = 0.0, 0.0, 0.0, 0.0
    gx, gy, gz, gl = 0.0, 0.0, 0.0, 0.0
    for u in range(s.shape[0]):
        square = s[u, 0] * s[u, 0] + s[u, 1] * s[u, 1] + s[u, 2] * s[u, 2] - y[u] * y[u] - right
        dx, dy, dz, dl = s[u, 0] - mx, s[u, 1] - my, s[u, 2] - mz, y[u] - ml
        half = 0.5 * weight[u] * square
        gx, gy, gz, gl = gx + half * dx, gy + half * dy, gz + half * dz, gl + half * dl
        wx, wy, wz = weight[u] * dx, weight[u] * dy, weight[u] * dz
        xx, xy, yy = xx + wx * dx, xy + wx * dy, yy + wy * dy
        xz, yz, zz = xz + wx * dz, yz + wy * dz, zz + wz * dz
        xl, yl, zl, ll = xl + wx * dl, yl + wy * dl, zl + wz * dl, ll + weight[u] * dl * dl
    a[0, 0], a[1, 0], a[1, 1], a[2, 0], a[2, 1], a[2, 2] = xx, xy, yy, xz, yz, zz
    a[3, 0], a[3, 1], a[3, 2], a[3, 3] = xl, yl, zl, ll
    g[0], g[1], g[2], g[3] = gx, gy, gz, gl
    return True


@kernel
def squared_start(s, y, weight, axes, x, a, g):
    """x (4,) <- frame anchor and zero of a cable that explain squared lengths, |s|^2 - y^2 = 2 s.a + 2 y l0 - (|a|^2 - l0^2), linear
    in (a, l0, |a|^2 - l0^2) and centred, so that the last is gone; False where the list leaves a direction open.

    s (U, 3), y and weight (U,), axes (k,): the components of a that are sought, the others stay as in x; a (4, 4) and g (4,) are
    work space.
    """
    k = axes.shape[0] + 1
    total, mean, right = 0.0, np.zeros(4), 0.0
    row = np.empty(4)
    if k == 4 and not centred(s, y, weight, a, g):
        return False
    for turn in range(2 if k < 4 else 0):
        if turn == 1:
            if total == 0.0:
                return False
            for i in range(k):
                mean[i] /= total
            right /= total
            a[:], g[:] = 0.0, 0.0
        middle = 0.0
        for u in range(s.shape[0]):
            w = weight[u]
            if w == 0.0:
                continue
            square = 0.0
            for i in range(3):
                square += (s[u, i] - x[i]) ** 2
            for i in range(k - 1):
                row[i] = s[u, axes[i]]
                square += row[i] ** 2 - (row[i] - x[axes[i]]) ** 2
            row[k - 1] = y[u]
            square -= y[u] * y[u]
            if turn == 0:
                total += w
                right += w * square
                for i in range(k):
                    mean[i] += w * row[i]
                continue
            for i in range(k):
                row[i] -= mean[i]
            middle = square - right
            for i in range(k):
                g[i] += 0.5 * w * middle * row[i]
                for j in range(i + 1):
                    a[i, j] += w * row[i] * row[j]
    largest = 0.0
    for i in range(k):
        largest = max(largest, a[i, i])
    if not cholesky(a, k):
        return False
    for i in range(k):
        if not a[i, i] * a[i, i] > FLAT * largest:
            return False
    forward(a, k, g)
    backward(a, k, g)
    for i in range(k - 1):
        x[axes[i]] = g[i]
    x[3] = g[k - 1]
    return True


@kernel
def spatial(s, y, share, weight, x, a, g):
    """`normal_of` of lengths in space: what the compiler knows to be four numbers takes a third of the time."""
    ax, ay, az, zero = x[0], x[1], x[2], x[3]
    xx, xy, yy, xz, yz, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    xl, yl, zl, ll = 0.0, 0.0, 0.0, 0.0
    gx, gy, gz, gl, cost = 0.0, 0.0, 0.0, 0.0, 0.0
    for u in range(s.shape[0]):
        w = weight[u]
        dx, dy, dz = ax - s[u, 0], ay - s[u, 1], az - s[u, 2]
        full = math.sqrt(dx * dx + dy * dy + dz * dz)
        r = share[u] * full - y[u] - zero
        f = share[u] / max(full, TINY)
        dx, dy, dz, wr = f * dx, f * dy, f * dz, w * r
        cost += wr * r
        gx, gy, gz, gl = gx + wr * dx, gy + wr * dy, gz + wr * dz, gl - wr
        wx, wy, wz = w * dx, w * dy, w * dz
        xx, xy, yy = xx + wx * dx, xy + wx * dy, yy + wy * dy
        xz, yz, zz = xz + wx * dz, yz + wy * dz, zz + wz * dz
        xl, yl, zl, ll = xl - wx, yl - wy, zl - wz, ll + w
    a[0, 0], a[1, 0], a[1, 1], a[2, 0], a[2, 1], a[2, 2] = xx, xy, yy, xz, yz, zz
    a[3, 0], a[3, 1], a[3, 2], a[3, 3] = xl, yl, zl, ll
    g[0], g[1], g[2], g[3] = gx, gy, gz, gl
    return 0.5 * cost


@kernel
def normal_of(kind, s, y, share, weight, axes, x, a, g):
    """Half the weighted sum of squares at x (4,), its gradient g and matrix a (lower triangle) over the sought components."""
    k = axes.shape[0] + 1
    if kind == LENGTH and k == 4:
        return spatial(s, y, share, weight, x, a, g)
    row = np.empty(4)
    a[:], g[:] = 0.0, 0.0
    cost = 0.0
    for u in range(s.shape[0]):
        w = weight[u]
        if w == 0.0:
            continue
        dx, dy, dz = s[u, 0] - x[0], s[u, 1] - x[1], s[u, 2] - x[2]
        full = math.sqrt(dx * dx + dy * dy + dz * dz)
        said = y[u] + x[3]
        row[0], row[1], row[2] = -dx, -dy, -dz
        if kind == LENGTH:
            r = share[u] * full - said
            f, last = share[u] / full if full > 0.0 else 0.0, -1.0
        else:
            f, last = 2.0 * share[u] * share[u], -2.0 * said
            r = 0.5 * f * full * full - said * said
        for i in range(k - 1):
            row[i] = f * row[axes[i]]  # axes ascend
        row[k - 1] = last
        cost += 0.5 * w * r * r
        for i in range(k):
            g[i] += w * r * row[i]
            for j in range(i + 1):
                a[i, j] += w * row[i] * row[j]
    return cost


@kernel
def refine(kind, s, y, share, weight, axes, x, a, g):
    """Levenberg-Marquardt from x (4,), in place: half the weighted sum of squares, how many steps, and why it ended. a and g are the
    normal equations there."""
    k = axes.shape[0] + 1
    m, v, new = np.empty((4, 4)), np.empty(4), np.empty(4)
    a2, g2 = np.empty((4, 4)), np.empty(4)
    lam = 0.0
    cost = normal_of(kind, s, y, share, weight, axes, x, a, g)
    scale = 0.0
    for u in range(s.shape[0]):
        scale += weight[u] * (y[u] + x[3]) ** 2
    if kind == SQUARED:
        scale *= scale
    for count in range(ITERATIONS):
        largest = 0.0
        for i in range(k):
            largest = max(largest, a[i, i])
        for i in range(k):
            for j in range(i + 1):
                m[i, j] = a[i, j]
            m[i, i] += lam * max(a[i, i], FLAT * largest)
            v[i] = -g[i]
        if not cholesky(m, k):
            if lam > 1e10:
                return cost, count, DEGENERATE
            lam = max(lam, 1e-9) * RAISE
            continue
        forward(m, k, v)
        promised = 0.0
        for i in range(k):
            promised += 0.5 * v[i] * v[i]
        backward(m, k, v)
        for i in range(4):
            new[i] = x[i]
        for i in range(k - 1):
            new[axes[i]] += v[i]
        new[3] += v[k - 1]
        if promised <= SMALL * scale:
            for i in range(4):
                x[i] = new[i]
            return cost, count, SETTLED
        after = normal_of(kind, s, y, share, weight, axes, new, a2, g2)
        if after < cost:
            lam = lam * SHRINK if lam > 1e-12 else 0.0
            cost = after
            for i in range(4):
                x[i], g[i] = new[i], g2[i]
                for j in range(i + 1):
                    a[i, j] = a2[i, j]
        elif promised <= 1e-12 * cost:  # what is promised is lost in rounding
            return cost, count, SETTLED
        else:
            lam = max(lam, 1e-6) * RAISE
            if lam > 1e12:
                return cost, count, LOST
    return cost, ITERATIONS, LOST


@kernel
def fit_cables(kind, t, b, y, stretch, weight, axes, given, x, cost, count, reason, info):
    """Every cable of every list by itself: x (B, m, 4) <- frame anchor and zero.

    t (1 or B, U, 4, 4), b (m, 3), y, stretch (strain) and weight (1 or B, U, m): weight zero where nothing was read;
    `given`: whether x holds a start, otherwise the components that are not sought. info (B, m, k, k), k = len(axes) + 1: the normal
    matrix.
    """
    poses, k = t.shape[1], axes.shape[0] + 1
    s, own, share, w = np.empty((poses, 3)), np.empty(poses), np.empty(poses), np.empty(poses)
    a, g = np.empty((4, 4)), np.empty(4)
    lists, cables, alike = x.shape[0], b.shape[0], t.shape[0] == 1
    for q in range(lists * cables):
        # Poses that all lists share are turned once for each cable; others stay near while all cables need them.
        n, i = (q % lists, q // lists) if alike else (q // cables, q % cables)
        tn, yn = n if t.shape[0] > 1 else 0, n if y.shape[0] > 1 else 0
        sn, wn = n if stretch.shape[0] > 1 else 0, n if weight.shape[0] > 1 else 0
        if n == 0 or not alike:
            attached(t[tn], b[i], s)
        for u in range(poses):
            own[u], share[u], w[u] = y[yn, u, i], 1.0 / (1.0 + stretch[sn, u, i]), weight[wn, u, i]
        if not given and not squared_start(s, own, w, axes, x[n, i], a, g):
            x[n, i, :] = math.nan
            reason[n, i] = DEGENERATE
            cost[n, i] = math.nan
            info[n, i] = math.nan
            continue
        cost[n, i], count[n, i], reason[n, i] = refine(kind, s, own, share, w, axes, x[n, i], a, g)
        for p in range(k):
            for e in range(k):
                info[n, i, p, e] = a[max(p, e), min(p, e)]
