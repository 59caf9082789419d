"""Compiled composition of moving frames; (v, w) rows of a Jacobian are those of the end frame in the first frame's
coordinates."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
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
