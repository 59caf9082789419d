"""Compiled equilibrium W t + w = 0 of one pose: length and direction of a cable, structure matrix, triangular factor, shortest
solution, null space; orthonormal rows."""

from __future__ import annotations

import math

from robocal._jit import kernel

_SHORTEST = 1e-9  # m
_RANK = 1e-10  # a pivot this small beside the first one is none


@kernel
def structure_kernel(pose, a, b, out):
    """out (k, 6, m) <- columns (u_i, R b_i x u_i), u_i from platform anchor to frame anchor."""
    for k in range(pose.shape[0]):
        x = pose[k]
        for i in range(a.shape[0]):
            lx = x[0, 0] * b[i, 0] + x[0, 1] * b[i, 1] + x[0, 2] * b[i, 2]
            ly = x[1, 0] * b[i, 0] + x[1, 1] * b[i, 1] + x[1, 2] * b[i, 2]
            lz = x[2, 0] * b[i, 0] + x[2, 1] * b[i, 1] + x[2, 2] * b[i, 2]
            ux, uy, uz = a[i, 0] - x[0, 3] - lx, a[i, 1] - x[1, 3] - ly, a[i, 2] - x[2, 3] - lz
            length = math.sqrt(ux * ux + uy * uy + uz * uz)
            inverse = 1.0 / length if length > _SHORTEST else math.nan  # a direction made of rounding is none
            ux, uy, uz = ux * inverse, uy * inverse, uz * inverse
            out[k, 0, i], out[k, 1, i], out[k, 2, i] = ux, uy, uz
            out[k, 3, i] = ly * uz - lz * uy
            out[k, 4, i] = lz * ux - lx * uz
            out[k, 5, i] = lx * uy - ly * ux


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


@kernel
def factor(h, diagonal, tau, order):
    """Rank of W = P L Q^T by Householder reflections with pivoted rows; h (d, m) holds W and then L and the reflectors."""
    d, m = h.shape
    top = 0.0
    for i in range(d):
        order[i] = i
    for k in range(min(d, m)):
        best, pick = -1.0, k
        for i in range(k, d):
            s = 0.0
            for j in range(k, m):
                s += h[i, j] * h[i, j]
            if s > best:
                best, pick = s, i
        if k == 0:
            top = best
        if not best > _RANK * _RANK * top:
            return k
        if pick != k:
            order[k], order[pick] = order[pick], order[k]
            for j in range(m):
                h[k, j], h[pick, j] = h[pick, j], h[k, j]
        first = h[k, k]
        alpha = -math.copysign(math.sqrt(best), first)
        diagonal[k] = alpha
        tau[k] = (alpha - first) / alpha
        inverse = 1.0 / (first - alpha)
        for j in range(k + 1, m):
            h[k, j] *= inverse
        for i in range(k + 1, d):
            s = h[i, k]
            for j in range(k + 1, m):
                s += h[k, j] * h[i, j]
            s *= tau[k]
            h[i, k] -= s
            for j in range(k + 1, m):
                h[i, j] -= s * h[k, j]
    return min(d, m)


@kernel
def reflect(h, tau, rank, x):
    """x (m,) <- Q x."""
    m = h.shape[1]
    for k in range(rank - 1, -1, -1):
        s = x[k]
        for j in range(k + 1, m):
            s += h[k, j] * x[j]
        s *= tau[k]
        x[k] -= s
        for j in range(k + 1, m):
            x[j] -= s * h[k, j]


@kernel
def solve(h, diagonal, tau, order, rank, w, allowed, t):
    """Whether W t = -w has a solution, up to `allowed` [N, N m] in rows that depend on others; t (m,) <- the shortest one."""
    d = h.shape[0]
    size = 0.0
    for j in range(t.shape[0]):
        t[j] = 0.0
    for k in range(d):
        s = -w[order[k]]
        size = max(size, abs(s))
        for j in range(min(k, rank)):
            s -= h[k, j] * t[j]
        if k < rank:
            t[k] = s / diagonal[k]
        elif abs(s) > 1e-9 * size + allowed:
            return False
    reflect(h, tau, rank, t)
    return True


@kernel
def null_rows(h, tau, rank, n):
    """Rows 0 ... m - rank - 1 of n <- an orthonormal basis of the null space of W."""
    m = h.shape[1]
    for c in range(m - rank):
        for j in range(m):
            n[c, j] = 0.0
        n[c, rank + c] = 1.0
        reflect(h, tau, rank, n[c])


@kernel
def orthonormalise(q, tri, count):
    """Rows 0 ... count - 1 of q (., n) <- orthonormal ones in their order (Gram-Schmidt, twice); row i was sum_j tri[j, i] q_j."""
    n = q.shape[1]
    for a in range(count):
        for j in range(a):
            tri[j, a] = 0.0
        for _ in range(2):
            for j in range(a):
                s = 0.0
                for c in range(n):
                    s += q[j, c] * q[a, c]
                tri[j, a] += s
                for c in range(n):
                    q[a, c] -= s * q[j, c]
        s = 0.0
        for c in range(n):
            s += q[a, c] * q[a, c]
        tri[a, a] = math.sqrt(s)
        for c in range(n):
            q[a, c] /= tri[a, a]


@kernel
def back_substitute(tri, count, y):
    """y (count,) <- tri^-1 y, tri upper triangular."""
    for a in range(count - 1, -1, -1):
        for j in range(a + 1, count):
            y[a] -= tri[a, j] * y[j]
        y[a] /= tri[a, a]
