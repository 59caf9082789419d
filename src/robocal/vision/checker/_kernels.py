"""Compiled fit of the crossing of two straight edges to the pixels of the four squares around it.

parameters (9,): place u, v; directions of the edges a, b (rad); blur (px); light:
    grey = o0 + o1 du + o2 dv + g (E(z1) E(z2) + 4 f(z1) f(z2) (r + r^2 z1 z2 / 2 + r^3 (z1^2 - 1) (z2^2 - 1) / 6))
z is the distance from an edge in standard deviations of the blur, with the pixel's own width; E(z) = 2 F(z) - 1 of the normal law F with
density f; r is the cosine between the edges, for a blurred crossing is a bivariate normal law (Mehler's series).
"""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.estimate._kernels import backward, cholesky, forward

SIZE = 9
BOX = 1.0 / 12.0  # px^2, the variance of a pixel's own width
WHOLE = 1.0 / math.sqrt(2.0 * math.pi)


@kernel
def sum_crossing(grey, u, v, p, limit, g, a):
    """g (9,), lower a (9, 9) <- gradient and normal matrix of the robust cost (Huber), which is returned; grey, u, v (m,)."""
    row = np.empty(SIZE)
    g[:] = 0.0
    a[:, :] = 0.0
    variance = p[4] * p[4] + BOX
    s = math.sqrt(variance)
    ca, sa, cb, sb = math.cos(p[2]), math.sin(p[2]), math.cos(p[3]), math.sin(p[3])
    r = ca * cb + sa * sb
    cost = 0.0
    for i in range(len(grey)):
        du, dv = u[i] - p[0], v[i] - p[1]
        z1, z2 = (ca * dv - sa * du) / s, (cb * dv - sb * du) / s
        f1, f2 = WHOLE * math.exp(-0.5 * z1 * z1), WHOLE * math.exp(-0.5 * z2 * z2)
        e1, e2 = math.erf(z1 / math.sqrt(2.0)), math.erf(z2 / math.sqrt(2.0))
        q1, q2 = z1 * z1 - 1.0, z2 * z2 - 1.0
        c = 4.0 * f1 * f2
        t = e1 * e2 + c * (r + 0.5 * r * r * z1 * z2 + r**3 * q1 * q2 / 6.0)
        t1 = 2.0 * f1 * e2 - c * (r * z1 + 0.5 * r * r * q1 * z2 + r**3 * z1 * (q1 - 2.0) * q2 / 6.0)
        t2 = 2.0 * f2 * e1 - c * (r * z2 + 0.5 * r * r * q2 * z1 + r**3 * z2 * (q2 - 2.0) * q1 / 6.0)
        left = p[5] + p[6] * du + p[7] * dv + p[8] * t - grey[i]
        weight = 1.0
        if abs(left) > limit:
            weight = limit / abs(left)
            cost += limit * (abs(left) - 0.5 * limit)
        else:
            cost += 0.5 * left * left
        row[0] = p[8] * (t1 * sa + t2 * sb) / s - p[6]
        row[1] = -p[8] * (t1 * ca + t2 * cb) / s - p[7]
        along = c * (1.0 + r * z1 * z2)  # of r
        row[2] = p[8] * (-t1 * (ca * du + sa * dv) / s + along * (ca * sb - sa * cb))
        row[3] = p[8] * (-t2 * (cb * du + sb * dv) / s + along * (sa * cb - ca * sb))
        row[4] = -p[8] * (t1 * z1 + t2 * z2) * p[4] / variance
        row[5], row[6], row[7], row[8] = 1.0, du, dv, t
        for j in range(SIZE):
            g[j] += weight * row[j] * left
            for k in range(j + 1):
                a[j, k] += weight * row[j] * row[k]
    return cost


@kernel
def fit_crossing(grey, u, v, p, limit, rounds, still, a):
    """Levenberg-Marquardt from p (9,), in place, until the crossing moves by less than `still` px; lower a (9, 9) <- the
    normal matrix there. Returns the cost, or -1 where it finds no step."""
    g, trial_g, q, step = np.empty(SIZE), np.empty(SIZE), np.empty(SIZE), np.empty(SIZE)
    trial_a, held = np.empty((SIZE, SIZE)), np.empty((SIZE, SIZE))
    lam = 1e-3
    cost = sum_crossing(grey, u, v, p, limit, g, a)
    for _ in range(rounds):
        for i in range(SIZE):
            for j in range(i):
                held[i, j] = a[i, j]
            held[i, i] = a[i, i] * (1.0 + lam) + 1e-9
            step[i] = -g[i]
        good = cholesky(held, SIZE)
        if good:
            forward(held, SIZE, step)
            backward(held, SIZE, step)
            for i in range(SIZE):
                q[i] = p[i] + step[i]
            q[4] = min(max(abs(q[4]), 0.05), 8.0)
            trial = sum_crossing(grey, u, v, q, limit, trial_g, trial_a)
            good = trial <= cost
        if not good:
            lam *= 10.0
            if lam > 1e6:
                return cost if cost >= 0.0 else -1.0
            continue
        moved = max(abs(q[0] - p[0]), abs(q[1] - p[1]))
        p[:], g[:], a[:, :] = q, trial_g, trial_a
        cost, lam = trial, max(0.1 * lam, 1e-9)
        if moved < still:
            break
    return cost
