"""Pixels of points that move together, in compiled code; (v, w) rows of a Jacobian are those of a frame in the camera's axes."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.estimate._kernels import LANES, add_shared_columns, kept, products, robust


@kernel
def project_point(x, y, z, f, uv, jp, ji):
    """Pixels uv (2,) of a point in camera coordinates, jp (2, 3) and ji (2, 9): `vision.camera.project` for one point."""
    fx, fy, k1, k2, p1, p2, k3 = f[0], f[1], f[4], f[5], f[6], f[7], f[8]
    iz = 1.0 / z
    x, y = x * iz, y * iz
    xx, yy, xy = x * x, y * y, x * y
    r2 = xx + yy
    d = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3)  # of d with respect to r2
    xd = x * d + 2.0 * p1 * xy + p2 * (r2 + 2.0 * xx)
    yd = y * d + p1 * (r2 + 2.0 * yy) + 2.0 * p2 * xy
    a = d + 2.0 * xx * slope + 2.0 * p1 * y + 6.0 * p2 * x
    b = 2.0 * xy * slope + 2.0 * p1 * x + 2.0 * p2 * y
    c = d + 2.0 * yy * slope + 6.0 * p1 * y + 2.0 * p2 * x
    uv[0], uv[1] = fx * xd + f[2], fy * yd + f[3]
    jp[0, 0], jp[0, 1], jp[0, 2] = fx * a * iz, fx * b * iz, -fx * iz * (a * x + b * y)
    jp[1, 0], jp[1, 1], jp[1, 2] = fy * b * iz, fy * c * iz, -fy * iz * (b * x + c * y)
    ji[0, 0], ji[0, 1], ji[0, 2], ji[0, 3] = xd, 0.0, 1.0, 0.0
    ji[1, 0], ji[1, 1], ji[1, 2], ji[1, 3] = 0.0, yd, 0.0, 1.0
    ji[0, 4], ji[0, 5], ji[0, 8] = fx * x * r2, fx * x * r2 * r2, fx * x * r2 * r2 * r2
    ji[1, 4], ji[1, 5], ji[1, 8] = fy * y * r2, fy * y * r2 * r2, fy * y * r2 * r2 * r2
    ji[0, 6], ji[0, 7] = 2.0 * fx * xy, fx * (r2 + 2.0 * xx)
    ji[1, 6], ji[1, 7] = fy * (r2 + 2.0 * yy), 2.0 * fy * xy


@kernel
def congruence(h, c, both, half, out, g, gout):
    """out <- [G 0; 0 1]^T h [G 0; 0 1], gout <- [G 0; 0 1]^T g: from six motions of a frame and c numbers of an instrument to what
    moves the frame, G = both (6, q); h (6 + c, 6 + c) and out (q + c, q + c) lower triangles, half (6, q) is work space."""
    # Sums over the six motions are written out: one pass over contiguous columns each.
    q = both.shape[1]
    m0, m1, m2, m3, m4, m5 = both[0], both[1], both[2], both[3], both[4], both[5]
    for i in range(6):
        a0, a1, a2 = h[i, 0], h[max(i, 1), min(i, 1)], h[max(i, 2), min(i, 2)]
        a3, a4, a5 = h[max(i, 3), min(i, 3)], h[max(i, 4), min(i, 4)], h[5, i]
        row = half[i]
        for k in range(q):
            row[k] = a0 * m0[k] + a1 * m1[k] + a2 * m2[k] + a3 * m3[k] + a4 * m4[k] + a5 * m5[k]
    n0, n1, n2, n3, n4, n5 = half[0], half[1], half[2], half[3], half[4], half[5]
    for p in range(q):
        a0, a1, a2, a3, a4, a5 = m0[p], m1[p], m2[p], m3[p], m4[p], m5[p]
        row = out[p]
        for k in range(p + 1):
            row[k] = a0 * n0[k] + a1 * n1[k] + a2 * n2[k] + a3 * n3[k] + a4 * n4[k] + a5 * n5[k]
        gout[p] = a0 * g[0] + a1 * g[1] + a2 * g[2] + a3 * g[3] + a4 * g[4] + a5 * g[5]
    for p in range(c):
        a0, a1, a2, a3, a4, a5 = h[6 + p, 0], h[6 + p, 1], h[6 + p, 2], h[6 + p, 3], h[6 + p, 4], h[6 + p, 5]
        row = out[q + p]
        for k in range(q):
            row[k] = a0 * m0[k] + a1 * m1[k] + a2 * m2[k] + a3 * m3[k] + a4 * m4[k] + a5 * m5[k]
        for k in range(p + 1):
            row[q + k] = h[6 + p, 6 + k]
        gout[q + p] = g[6 + p]


@kernel
def evaluate_sights(t, jac, jloc, sight, first, point, intrinsics, own, r, out, local):
    """r (B, m, 2) <- the pixels at which points are seen, out (B, m, 2, k + c) and local (B, m, 2, l) <- their Jacobians by what moves
    the frames, t (B, S, 4, 4), jac (B, S, 6, k), jloc (B, S, 6, l), and by c numbers of the instrument; row i is point first + i, and
    sight (m,) its frame."""
    k, nl, c = jac.shape[3], jloc.shape[3], own.shape[0]
    uv, jp, ji = np.empty(2), np.empty((2, 3)), np.zeros((2, 9))
    for b in range(r.shape[0]):
        for i in range(r.shape[1]):
            f, j, jl = t[b, sight[i]], jac[b, sight[i]], jloc[b, sight[i]]
            x, y, z = point[first + i, 0], point[first + i, 1], point[first + i, 2]
            lx = f[0, 0] * x + f[0, 1] * y + f[0, 2] * z
            ly = f[1, 0] * x + f[1, 1] * y + f[1, 2] * z
            lz = f[2, 0] * x + f[2, 1] * y + f[2, 2] * z
            project_point(lx + f[0, 3], ly + f[1, 3], lz + f[2, 3], intrinsics[b], uv, jp, ji)
            for e in range(2):
                r[b, i, e] = uv[e]
                # d point = v + w x lever, so d uv = jp v + (lever x jp) w row by row.
                a0, a1, a2 = jp[e, 0], jp[e, 1], jp[e, 2]
                a3, a4, a5 = ly * a2 - lz * a1, lz * a0 - lx * a2, lx * a1 - ly * a0
                row = out[b, i, e]
                for p in range(k):
                    row[p] = a0 * j[0, p] + a1 * j[1, p] + a2 * j[2, p] + a3 * j[3, p] + a4 * j[4, p] + a5 * j[5, p]
                for p in range(c):
                    row[k + p] = ji[e, own[p]]
                row = local[b, i, e]
                for p in range(nl):
                    row[p] = (
                        a0 * jl[0, p] + a1 * jl[1, p] + a2 * jl[2, p] + a3 * jl[3, p] + a4 * jl[4, p] + a5 * jl[5, p]
                    )


@kernel
def accumulate_views(
    t, jac, jloc, first, cut, views, edges, seat, seats, free, intrinsics, own, point, value, scale, weight, configuration,
    columns, one, two, pair, loss, tuning, curved, cost, g, a, gl, al, asl, gm, am, asm, cross,
):  # fmt: skip
    """Adds pixels to the normal equations, view by view: rows edges[i] to edges[i + 1] are a sight, points of one target; sights
    views[v] to views[v + 1] are those of view v, whose targets stand still against one another.

    t (B, m, 4, 4), jac (B, m, 6, k) and jloc (B, m, 6, l + q) are those of the views first .. first + m; the first `cut` columns
    of jloc are a block's of the first family. seats (B, T, 4, 4) say where targets are in a view, free (T, 6) the tangent columns of
    their motions or -1, seat (S,) which target a sight shows. intrinsics (B, 9), own (c,) those that are free, columns (k + c,);
    one, two and pair (V,) the blocks and the pair of every view. The rest is as in `estimate._kernels.accumulate`.
    """
    batch, m = t.shape[0], t.shape[1]
    k, nl, c = jac.shape[3], jloc.shape[3], own.shape[0]
    shared, q, size = k + c, k + nl, 6 + c
    uv, jp, ji = np.empty(2), np.empty((2, 3)), np.zeros((2, 9))
    lanes = (size + LANES - 1) // LANES * LANES
    most = 0
    for s in range(views[first], views[first + m]):
        most = max(most, edges[s + 1] - edges[s])
    heap, h, gs = np.zeros((lanes, 2 * most)), np.empty((lanes, lanes)), np.empty(size)
    whole, gv = np.empty((lanes, lanes)), np.empty(size)
    both, half = np.empty((6, q)), np.empty((6, q))
    out, gout = np.empty((q + c, q + c)), np.empty(q + c)
    small_a, small_g = np.zeros((shared, shared)), np.zeros(shared)
    loose = np.zeros(free.shape[0], np.bool_)
    for s in range(free.shape[0]):
        for p in range(6):
            loose[s] |= free[s, p] >= 0
    own_g, own_a, wide = (
        np.zeros((free.shape[0], 6)),
        np.zeros((free.shape[0], 6, 6)),
        np.zeros((free.shape[0], 6, shared)),
    )
    carried, turned = np.zeros((6, 6)), np.empty((size, 6))
    # The frame's shared columns, then the instrument's, then those of local blocks: where each lies in `out`.
    at = np.empty(shared, np.int64)
    for i in range(k):
        at[i] = i
    for i in range(c):
        at[k + i] = q + i
    for b in range(batch):
        wb = b if weight.shape[0] > 1 else 0
        vb = b if value.shape[0] > 1 else 0
        small_a[:] = 0.0
        small_g[:] = 0.0
        own_g[:] = 0.0
        own_a[:] = 0.0
        wide[:] = 0.0
        for v in range(m):
            whole[:] = 0.0
            gv[:] = 0.0
            f = t[b, v]
            seen = 0
            for i in range(6):
                for p in range(k):
                    both[i, p] = jac[b, v, i, p]
                for p in range(nl):
                    both[i, k + p] = jloc[b, v, i, p]
            for s in range(views[first + v], views[first + v + 1]):
                h[:] = 0.0
                gs[:] = 0.0
                waiting = 0
                d = seats[b, seat[s]]
                for i in range(edges[s], edges[s + 1]):
                    w = weight[wb, configuration[i]]
                    if w == 0.0 or (scale[i, 0] == 0.0 and scale[i, 1] == 0.0):
                        continue
                    x = d[0, 0] * point[i, 0] + d[0, 1] * point[i, 1] + d[0, 2] * point[i, 2] + d[0, 3]
                    y = d[1, 0] * point[i, 0] + d[1, 1] * point[i, 1] + d[1, 2] * point[i, 2] + d[1, 3]
                    z = d[2, 0] * point[i, 0] + d[2, 1] * point[i, 1] + d[2, 2] * point[i, 2] + d[2, 3]
                    lx = f[0, 0] * x + f[0, 1] * y + f[0, 2] * z
                    ly = f[1, 0] * x + f[1, 1] * y + f[1, 2] * z
                    lz = f[2, 0] * x + f[2, 1] * y + f[2, 2] * z
                    project_point(lx + f[0, 3], ly + f[1, 3], lz + f[2, 3], intrinsics[b], uv, jp, ji)
                    r0, r1 = (uv[0] - value[vb, i, 0]) * scale[i, 0], (uv[1] - value[vb, i, 1]) * scale[i, 1]
                    rho, slope = robust(loss, tuning, r0 * r0 + r1 * r1)
                    cost[b] += 0.5 * w * rho
                    w *= slope
                    if w == 0.0 or (q + c == 0 and not loose[seat[s]]):
                        continue
                    root = math.sqrt(w)
                    for e in range(2):
                        u = root * scale[i, e]
                        jx, jy, jz = u * jp[e, 0], u * jp[e, 1], u * jp[e, 2]
                        heap[0, waiting], heap[1, waiting], heap[2, waiting] = jx, jy, jz
                        heap[3, waiting] = ly * jz - lz * jy
                        heap[4, waiting] = lz * jx - lx * jz
                        heap[5, waiting] = lx * jy - ly * jx
                        for p in range(c):
                            heap[6 + p, waiting] = u * ji[e, own[p]]
                        u = root * (r1 if e else r0)
                        for p in range(size):
                            gs[p] += heap[p, waiting] * u
                        waiting += 1
                    share = kept(loss, tuning, r0 * r0 + r1 * r1) if curved[b] else 1.0
                    if share < 1.0:
                        u = (1.0 - share) / (r0 * r0 + r1 * r1)
                        for p in range(size):
                            x = u * (r0 * heap[p, waiting - 2] + r1 * heap[p, waiting - 1])
                            heap[p, waiting - 2] -= x * r0
                            heap[p, waiting - 1] -= x * r1
                if not waiting:
                    continue
                products(heap, waiting, h)
                seen += waiting
                for i in range(size):
                    gv[i] += gs[i]
                    for p in range(i + 1):
                        whole[i, p] += h[i, p]
                if loose[seat[s]]:
                    add_seat(f, d, h, gs, both, k, c, carried, turned, own_g[seat[s]], own_a[seat[s]], wide[seat[s]])
                    for j in range(nl):
                        # A target's motions beside those of a block: where the pose of the view is free.
                        for o in range(6):
                            if free[seat[s], o] >= 0:
                                total = 0.0
                                for i in range(6):
                                    total += jloc[b, v, i, j] * turned[i, o]
                                if j < cut:
                                    asl[b, one[first + v], free[seat[s], o], j] += total
                                else:
                                    asm[b, two[first + v], free[seat[s], o], j - cut] += total
            if not seen or q + c == 0:
                continue
            congruence(whole, c, both, half, out, gv, gout)
            for p in range(shared):
                small_g[p] += gout[at[p]]
                for o in range(p + 1):
                    small_a[p, o] += out[at[p], at[o]]
            if cut > 0:
                add_sight_block(one[first + v], k, cut, c, out, gout, columns, gl[b], al[b], asl[b])
            if nl > cut:
                add_sight_block(two[first + v], k + cut, nl - cut, c, out, gout, columns, gm[b], am[b], asm[b])
                if cut > 0:
                    here = cross[b, pair[first + v]]
                    for p in range(cut):
                        for o in range(nl - cut):
                            here[p, o] += out[k + cut + o, k + p]
        add_shared_columns(columns, small_g, small_a, g[b], a[b])
        for s in range(free.shape[0]):
            if loose[s]:
                add_seat_columns(free[s], columns, own_g[s], own_a[s], wide[s], g[b], a[b])


@kernel
def add_seat(f, d, h, gs, both, k, c, carried, turned, g, a, wide):
    """Adds what one sight says of its target's own motions to g (6,), a (6, 6) and, beside the view's columns, wide (6, k + c).

    The target stands at d in a view at f: its motion (v, w) in the view's axes moves points as `carried` of it does about the view's
    origin, [R  (R p) x R; 0  R], p its place. h and gs are the sight's by motions about that origin and numbers of the instrument.
    """
    px = f[0, 0] * d[0, 3] + f[0, 1] * d[1, 3] + f[0, 2] * d[2, 3]
    py = f[1, 0] * d[0, 3] + f[1, 1] * d[1, 3] + f[1, 2] * d[2, 3]
    pz = f[2, 0] * d[0, 3] + f[2, 1] * d[1, 3] + f[2, 2] * d[2, 3]
    for i in range(3):
        for p in range(3):
            carried[i, p] = carried[3 + i, 3 + p] = f[i, p]
    for p in range(3):
        carried[0, 3 + p] = py * f[2, p] - pz * f[1, p]
        carried[1, 3 + p] = pz * f[0, p] - px * f[2, p]
        carried[2, 3 + p] = px * f[1, p] - py * f[0, p]
    for i in range(6 + c):
        for o in range(6):
            total = 0.0
            for j in range(6):
                total += h[max(i, j), min(i, j)] * carried[j, o]
            turned[i, o] = total
    for o in range(6):
        for j in range(6):
            g[o] += carried[j, o] * gs[j]
        for p in range(o + 1):
            for j in range(6):
                a[o, p] += carried[j, o] * turned[j, p]
        row = wide[o]
        b0, b1, b2, b3, b4, b5 = turned[0, o], turned[1, o], turned[2, o], turned[3, o], turned[4, o], turned[5, o]
        for p in range(k):
            row[p] += (
                b0 * both[0, p]
                + b1 * both[1, p]
                + b2 * both[2, p]
                + b3 * both[3, p]
                + b4 * both[4, p]
                + b5 * both[5, p]
            )
        for p in range(c):
            row[k + p] += turned[6 + p, o]


@kernel
def add_seat_columns(free, columns, own_g, own_a, wide, g, a):
    """Adds a target's own columns, free (6,) or -1, and what they share with other columns, to g and the lower triangle a."""
    for o in range(6):
        i = free[o]
        if i < 0:
            continue
        g[i] += own_g[o]
        for p in range(o + 1):
            j = free[p]
            if j >= 0:
                a[max(i, j), min(i, j)] += own_a[o, p]
        for p in range(columns.shape[0]):
            j = columns[p]
            a[max(i, j), min(i, j)] += 2.0 * wide[o, p] if i == j else wide[o, p]


@kernel
def add_sight_block(block, at, size, c, out, gout, columns, gl, al, asl):
    """Adds the columns at .. at + size of one sight to those of a local block; c numbers of the instrument come last."""
    k, q = columns.shape[0] - c, out.shape[0] - c
    for p in range(size):
        gl[block, p] += gout[at + p]
        for o in range(size):
            al[block, p, o] += out[at + max(p, o), at + min(p, o)]
        for o in range(k):
            asl[block, columns[o], p] += out[at + p, o]
        for o in range(c):
            asl[block, columns[k + o], p] += out[q + o, at + p]
