"""Compiled lengths of cables, straight or over pulleys, and their normal equations."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.estimate._kernels import kept, robust


@kernel
def length_of(dx, dy, dz, radius, axis, u):
    """Length from the frame anchor to the end (dx, dy, dz) away, and the unit vector u (3,) in which the cable arrives there:
    `cables.pulley.run` for one cable. Not a number inside a pulley."""
    if radius == 0.0:
        full = math.sqrt(dx * dx + dy * dy + dz * dz)
        f = 1.0 / full if full > 0.0 else 0.0
        u[0], u[1], u[2] = f * dx, f * dy, f * dz
        return full
    h = dx * axis[0] + dy * axis[1] + dz * axis[2]
    ax, ay, az = dx - h * axis[0], dy - h * axis[1], dz - h * axis[2]
    s = math.sqrt(ax * ax + ay * ay + az * az)
    square = s * (s - 2.0 * radius) + h * h
    if not square >= 0.0:
        u[:] = math.nan
        return math.nan
    free = math.sqrt(square)
    beta = math.atan2(h, radius - s) - math.atan2(free, radius)
    if beta < -1e-9:  # straight ahead the wrap is zero: rounding must not make a whole turn of it
        beta += 2.0 * math.pi
    f, c = (math.sin(beta) / s if s > 0.0 else 0.0), math.cos(beta)
    u[0], u[1], u[2] = f * ax + c * axis[0], f * ay + c * axis[1], f * az + c * axis[2]
    return radius * beta + free


@kernel(inline=True)
def slope_of(f, n, full, radius, axis, size, u, by, number):
    """Length of the cable with numbers n (7,) to a platform at f (4, 4), less its zero, and `size` times its slopes: by the pose, by
    (6,), and by the numbers, number (7,), where they are wanted (full); u (3,) is work space."""
    lx = f[0, 0] * n[3] + f[0, 1] * n[4] + f[0, 2] * n[5]
    ly = f[1, 0] * n[3] + f[1, 1] * n[4] + f[1, 2] * n[5]
    lz = f[2, 0] * n[3] + f[2, 1] * n[4] + f[2, 2] * n[5]
    length = length_of(f[0, 3] + lx - n[0], f[1, 3] + ly - n[1], f[2, 3] + lz - n[2], radius, axis, u) - n[6]
    by[0], by[1], by[2] = size * u[0], size * u[1], size * u[2]
    by[3], by[4], by[5] = ly * by[2] - lz * by[1], lz * by[0] - lx * by[2], lx * by[1] - ly * by[0]
    if full:
        for o in range(3):
            number[o] = -by[o]
            number[3 + o] = f[0, o] * by[0] + f[1, o] * by[1] + f[2, o] * by[2]
        number[6] = -size
    return length


@kernel
def evaluate_lengths(t, jac, jloc, numbers, radius, axis, sight, cable, edges, symbol, value, r, out, out_local):
    """Residuals r (B, m, 1) and Jacobians out (B, m, 1, k + c), zero before, and out_local (B, m, 1, l); the rest is as in
    `accumulate_lengths`."""
    batch, k, nl = t.shape[0], jac.shape[3], jloc.shape[3]
    u, by, number = np.empty(3), np.empty(6), np.empty(7)
    for b in range(batch):
        vb = b if value.shape[0] > 1 else 0
        for i in range(sight.shape[0]):
            c, s = cable[i], sight[i]
            wanted = edges[c + 1] > edges[c]
            r[b, i, 0] = (
                slope_of(t[b, s], numbers[b, c], wanted, radius[c], axis[c], 1.0, u, by, number) - value[vb, i, 0]
            )
            for p in range(k):
                for o in range(6):
                    out[b, i, 0, p] += by[o] * jac[b, s, o, p]
            for e in range(edges[c], edges[c + 1]):
                out[b, i, 0, k + e] = number[symbol[e]]
            for p in range(nl):
                out_local[b, i, 0, p] = 0.0
                for o in range(6):
                    out_local[b, i, 0, p] += by[o] * jloc[b, s, o, p]


@kernel
def accumulate_lengths(
    t, jac, jloc, numbers, radius, axis, sight, walk, cable, edges, symbol, value, scale, weight, configuration, columns, local, loss,
    tuning, curved, cost, g, a, gl, al, asl,
):  # fmt: skip
    """Adds lengths of cables to the normal equations.

    t (B, S, 4, 4), jac (B, S, 6, k) and jloc (B, S, 6, l) are those of the poses; row i is of pose sight[i] and of a cable, whose
    seven numbers are numbers (B, C, 7), of which edges[c] .. edges[c + 1] of symbol (c,) are free; walk (m,) takes the rows of a pose
    together. columns (k + c,): the pose's,
    then those of the free numbers. The rest is as in `estimate._kernels.accumulate`, d = 1.
    """
    batch, k, nl = t.shape[0], jac.shape[3], jloc.shape[3]
    u, by, number = np.empty(3), np.empty(6), np.empty(7)
    row, lrow = np.empty(k + 7), np.empty(nl)
    feeds = np.empty(k + 7, np.int64)
    for i in range(k):
        feeds[i] = columns[i]
    for b in range(batch):
        wb = b if weight.shape[0] > 1 else 0
        vb = b if value.shape[0] > 1 else 0
        for i in walk:
            w = weight[wb, configuration[i]]
            size = scale[i, 0]
            if w == 0.0 or size == 0.0:
                continue
            c, s = cable[i], sight[i]
            f, wanted = t[b, s], edges[c + 1] > edges[c]
            r = size * (slope_of(f, numbers[b, c], wanted, radius[c], axis[c], size, u, by, number) - value[vb, i, 0])
            rho, slope = robust(loss, tuning, r * r)
            cost[b] += 0.5 * w * rho
            w *= slope
            if w == 0.0:
                continue
            wide = k
            for p in range(k):
                row[p] = 0.0
                for o in range(6):
                    row[p] += by[o] * jac[b, s, o, p]
            for e in range(edges[c], edges[c + 1]):
                row[wide], feeds[wide] = number[symbol[e]], columns[k + e]
                wide += 1
            wr = w * r
            if curved[b]:
                w *= kept(loss, tuning, r * r) ** 2
            for p in range(wide):
                cp, v = feeds[p], w * row[p]
                g[b, cp] += wr * row[p]
                for o in range(p + 1):
                    cq = feeds[o]
                    if cp == cq and p != o:
                        a[b, cp, cp] += 2.0 * v * row[o]
                    elif cp >= cq:
                        a[b, cp, cq] += v * row[o]
                    else:
                        a[b, cq, cp] += v * row[o]
            at = local[i] if nl > 0 else -1
            if at >= 0:
                for p in range(nl):
                    lrow[p] = 0.0
                    for o in range(6):
                        lrow[p] += by[o] * jloc[b, s, o, p]
                for p in range(nl):
                    v = w * lrow[p]
                    gl[b, at, p] += wr * lrow[p]
                    for o in range(nl):
                        al[b, at, p, o] += v * lrow[o]
                for o in range(wide):
                    v, cq = w * row[o], feeds[o]
                    for p in range(nl):
                        asl[b, at, cq, p] += v * lrow[p]
