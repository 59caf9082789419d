"""Compiled composition of moving frames; (v, w) rows of a Jacobian are those of the end frame in the first frame's
coordinates."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.estimate._kernels import LANES, add_shared_columns, kept, products, robust
from robocal.geometry._kernels import rotation_from_vector, vector_from_rotation


@kernel
def frames_of(x, at, block, out):
    """out (B, m, 4, 4) <- the frames whose vectors begin at x[:, at + 6 block]."""
    for b in range(x.shape[0]):
        for m in range(block.shape[0]):
            v = x[b, at + 6 * block[m] :]
            t = out[b, m]
            rotation_from_vector(v[3], v[4], v[5], t)
            for i in range(3):
                t[i, 3] = v[i]
                t[3, i] = 0.0
            t[3, 3] = 1.0


@kernel
def inverse_kernel(t, jac, out, jout):
    """out <- T^-1, jout <- its Jacobian: w' = -R^T w, v' = R^T (w x p - v); jout rows 3 or 6."""
    high = jout.shape[2]
    for b in range(t.shape[0]):
        for m in range(t.shape[1]):
            r = t[b, m]
            px, py, pz = r[0, 3], r[1, 3], r[2, 3]
            for i in range(3):
                for j in range(3):
                    out[b, m, i, j] = r[j, i]
                out[b, m, i, 3] = -(r[0, i] * px + r[1, i] * py + r[2, i] * pz)
                out[b, m, 3, i] = 0.0
            out[b, m, 3, 3] = 1.0
            for k in range(jac.shape[3]):
                wx, wy, wz = jac[b, m, 3, k], jac[b, m, 4, k], jac[b, m, 5, k]
                x = wy * pz - wz * py - jac[b, m, 0, k]
                y = wz * px - wx * pz - jac[b, m, 1, k]
                z = wx * py - wy * px - jac[b, m, 2, k]
                for i in range(3):
                    jout[b, m, i, k] = r[0, i] * x + r[1, i] * y + r[2, i] * z
                    if high == 6:
                        jout[b, m, 3 + i, k] = -(r[0, i] * wx + r[1, i] * wy + r[2, i] * wz)


@kernel
def product_kernel(ta, ja, tb, jb, out, jout):
    """out <- Ta Tb; jout[..., :ka] from Ja, the rest from Jb: v = va + wa x (Ra pb) + Ra vb, w = wa + Ra wb."""
    ka = ja.shape[3]
    high = jout.shape[2]
    for b in range(out.shape[0]):
        for m in range(out.shape[1]):
            a = ta[b, m]
            c = tb[b, m]
            lx = a[0, 0] * c[0, 3] + a[0, 1] * c[1, 3] + a[0, 2] * c[2, 3]
            ly = a[1, 0] * c[0, 3] + a[1, 1] * c[1, 3] + a[1, 2] * c[2, 3]
            lz = a[2, 0] * c[0, 3] + a[2, 1] * c[1, 3] + a[2, 2] * c[2, 3]
            for i in range(3):
                for j in range(3):
                    out[b, m, i, j] = a[i, 0] * c[0, j] + a[i, 1] * c[1, j] + a[i, 2] * c[2, j]
                out[b, m, 3, i] = 0.0
            out[b, m, 0, 3] = lx + a[0, 3]
            out[b, m, 1, 3] = ly + a[1, 3]
            out[b, m, 2, 3] = lz + a[2, 3]
            out[b, m, 3, 3] = 1.0
            for k in range(ka):
                wx, wy, wz = ja[b, m, 3, k], ja[b, m, 4, k], ja[b, m, 5, k]
                jout[b, m, 0, k] = ja[b, m, 0, k] + wy * lz - wz * ly
                jout[b, m, 1, k] = ja[b, m, 1, k] + wz * lx - wx * lz
                jout[b, m, 2, k] = ja[b, m, 2, k] + wx * ly - wy * lx
                if high == 6:
                    jout[b, m, 3, k] = wx
                    jout[b, m, 4, k] = wy
                    jout[b, m, 5, k] = wz
            for k in range(jb.shape[3]):
                for i in range(3):
                    s = 0.0
                    for j in range(3):
                        s += a[i, j] * jb[b, m, j, k]
                    jout[b, m, i, ka + k] = s
                    if high == 6:
                        s = 0.0
                        for j in range(3):
                            s += a[i, j] * jb[b, m, 3 + j, k]
                        jout[b, m, 3 + i, ka + k] = s


@kernel
def pose_kernel(t, jac, jloc, y, yb, first, r):
    """r <- (p - p_y, log(R R_y^T)); the angular rows of jac and jloc become those of the logarithm (left Jacobian
    inverse)."""
    d = np.empty((3, 3))
    w = np.empty(3)
    for b in range(t.shape[0]):
        for m in range(t.shape[1]):
            a = t[b, m]
            c = y[yb[b], first + m]
            for i in range(3):
                r[b, m, i] = a[i, 3] - c[i, 3]
                for j in range(3):
                    d[i, j] = a[i, 0] * c[j, 0] + a[i, 1] * c[j, 1] + a[i, 2] * c[j, 2]
            vector_from_rotation(d, w)
            r[b, m, 3], r[b, m, 4], r[b, m, 5] = w[0], w[1], w[2]
            n2 = w[0] * w[0] + w[1] * w[1] + w[2] * w[2]
            if n2 < 1e-6:
                e = 1.0 / 12.0 + n2 / 720.0
            else:
                h = 0.5 * math.sqrt(n2)
                e = (1.0 - h * math.cos(h) / math.sin(h)) / n2
            for part in range(2):
                out = jac[b, m] if part == 0 else jloc[b, m]
                for k in range(out.shape[1]):
                    x, q, z = out[3, k], out[4, k], out[5, k]
                    ux, uy, uz = w[1] * z - w[2] * q, w[2] * x - w[0] * z, w[0] * q - w[1] * x
                    out[3, k] = x - 0.5 * ux + e * (w[1] * uz - w[2] * uy)
                    out[4, k] = q - 0.5 * uy + e * (w[2] * ux - w[0] * uz)
                    out[5, k] = z - 0.5 * uz + e * (w[0] * uy - w[1] * ux)


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
def accumulate_sights(
    t, jac, jloc, first, cut, intrinsics, own, edges, point, value, scale, weight, configuration, columns, one, two, pair,
    loss, tuning, curved, cost, g, a, gl, al, asl, gm, am, asm, cross,
):  # fmt: skip
    """Adds pixels to the normal equations, sight by sight: rows edges[i] to edges[i + 1] see points of one frame.

    t (B, m, 4, 4), jac (B, m, 6, k) and jloc (B, m, 6, l + q) are those of the sights first .. first + m; the first `cut` columns
    of jloc are a block's of the first family. intrinsics (B, 9), own (c,) those that are free, columns (k + c,); one, two and pair
    (S,) the blocks and the pair of every sight. The rest is as in `estimate._kernels.accumulate`.
    """
    batch, m = t.shape[0], t.shape[1]
    k, nl, c = jac.shape[3], jloc.shape[3], own.shape[0]
    shared, q, size = k + c, k + nl, 6 + c
    uv, jp, ji = np.empty(2), np.empty((2, 3)), np.zeros((2, 9))
    lanes = (size + LANES - 1) // LANES * LANES
    most = 0
    for s in range(first, first + m):
        most = max(most, edges[s + 1] - edges[s])
    heap, h, gs = np.zeros((lanes, 2 * most)), np.empty((lanes, lanes)), np.empty(size)
    both, half = np.empty((6, q)), np.empty((6, q))
    out, gout = np.empty((q + c, q + c)), np.empty(q + c)
    small_a, small_g = np.zeros((shared, shared)), np.zeros(shared)
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
        for s in range(m):
            h[:] = 0.0
            gs[:] = 0.0
            f = t[b, s]
            waiting = 0
            for i in range(edges[first + s], edges[first + s + 1]):
                w = weight[wb, configuration[i]]
                if w == 0.0 or (scale[i, 0] == 0.0 and scale[i, 1] == 0.0):
                    continue
                x, y, z = point[i, 0], point[i, 1], point[i, 2]
                lx = f[0, 0] * x + f[0, 1] * y + f[0, 2] * z
                ly = f[1, 0] * x + f[1, 1] * y + f[1, 2] * z
                lz = f[2, 0] * x + f[2, 1] * y + f[2, 2] * z
                project_point(lx + f[0, 3], ly + f[1, 3], lz + f[2, 3], intrinsics[b], uv, jp, ji)
                r0, r1 = (uv[0] - value[vb, i, 0]) * scale[i, 0], (uv[1] - value[vb, i, 1]) * scale[i, 1]
                rho, slope = robust(loss, tuning, r0 * r0 + r1 * r1)
                cost[b] += 0.5 * w * rho
                w *= slope
                if w == 0.0 or q + c == 0:
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
                        v = u * (r0 * heap[p, waiting - 2] + r1 * heap[p, waiting - 1])
                        heap[p, waiting - 2] -= v * r0
                        heap[p, waiting - 1] -= v * r1
            if not waiting:
                continue
            products(heap, waiting, h)
            for i in range(6):
                for p in range(k):
                    both[i, p] = jac[b, s, i, p]
                for p in range(nl):
                    both[i, k + p] = jloc[b, s, i, p]
            congruence(h, c, both, half, out, gs, gout)
            for p in range(shared):
                small_g[p] += gout[at[p]]
                for o in range(p + 1):
                    small_a[p, o] += out[at[p], at[o]]
            if cut > 0:
                add_sight_block(one[first + s], k, cut, c, out, gout, columns, gl[b], al[b], asl[b])
            if nl > cut:
                add_sight_block(two[first + s], k + cut, nl - cut, c, out, gout, columns, gm[b], am[b], asm[b])
                if cut > 0:
                    here = cross[b, pair[first + s]]
                    for p in range(cut):
                        for o in range(nl - cut):
                            here[p, o] += out[k + cut + o, k + p]
        add_shared_columns(columns, small_g, small_a, g[b], a[b])


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
