"""Residuals and Jacobians of the joint jobs as compiled kernels, for the peers that bring no model: frames are shift and rotation
vector, added component by component as Ceres does without a manifold."""

import math

import numpy as np
from numba import njit


@njit(cache=True)
def rotation(w, r):
    """R = exp(w) (3, 3)."""
    t2 = w[0] * w[0] + w[1] * w[1] + w[2] * w[2]
    t = math.sqrt(t2)
    s = math.sin(t) / t if t > 1e-8 else 1.0 - t2 / 6
    c = (1 - math.cos(t)) / t2 if t > 1e-4 else 0.5 - t2 / 24
    for i in range(3):
        for j in range(3):
            r[i, j] = c * w[i] * w[j]
        r[i, i] += 1.0 - c * t2
    r[0, 1] -= s * w[2]
    r[0, 2] += s * w[1]
    r[1, 0] += s * w[2]
    r[1, 2] -= s * w[0]
    r[2, 0] -= s * w[1]
    r[2, 1] += s * w[0]


@njit(cache=True)
def left(w, sign, out):
    """The left Jacobian at sign w, (3, 3)."""
    x, y, z = sign * w[0], sign * w[1], sign * w[2]
    t2 = x * x + y * y + z * z
    t = math.sqrt(t2)
    b = (1 - math.cos(t)) / t2 if t > 1e-4 else 0.5 - t2 / 24
    c = (t - math.sin(t)) / (t2 * t) if t > 1e-3 else 1 / 6 - t2 / 120
    v = (x, y, z)
    for i in range(3):
        for j in range(3):
            out[i, j] = c * v[i] * v[j]
        out[i, i] += 1.0 - c * t2
    out[0, 1] -= b * z
    out[0, 2] += b * y
    out[1, 0] += b * z
    out[1, 2] -= b * x
    out[2, 0] -= b * y
    out[2, 1] += b * x


@njit(cache=True)
def crossed(p, a, out):
    """out (3, 3) <- [p]x a."""
    for j in range(3):
        out[0, j] = p[1] * a[2, j] - p[2] * a[1, j]
        out[1, j] = p[2] * a[0, j] - p[0] * a[2, j]
        out[2, j] = p[0] * a[1, j] - p[1] * a[0, j]


@njit(cache=True)
def sight(view, eye, marker, lens, corners, uv, sigma, r, jv, je, jm, jl):
    """Four corners of a marker, in pixels: r (8,), flat Jacobians by view, eye, marker (8 x 6) and lens (8 x 8)."""
    rv, re, rm = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    lv, le, lm = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    rotation(view[3:], rv)
    rotation(eye[3:], re)
    rotation(marker[3:], rm)
    left(view[3:], -1.0, lv)
    left(eye[3:], -1.0, le)
    left(marker[3:], 1.0, lm)
    w, u, q, h, k = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    dw, dq, dk, by = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((2, 3))
    world, inner = np.empty((2, 3)), np.empty((2, 3))
    for c in range(4):
        for i in range(3):
            w[i] = 0.0
            for j in range(3):
                w[i] += rm[i, j] * corners[3 * c + j]
            u[i] = w[i] + marker[i] - view[i]
        for i in range(3):
            q[i] = rv[0, i] * u[0] + rv[1, i] * u[1] + rv[2, i] * u[2]
            h[i] = q[i] - eye[i]
        for i in range(3):
            k[i] = re[0, i] * h[0] + re[1, i] * h[1] + re[2, i] * h[2]
        x, y = k[0] / k[2], k[1] / k[2]
        r2 = x * x + y * y
        d, slope = 1.0 + r2 * (lens[4] + r2 * lens[5]), lens[4] + 2.0 * r2 * lens[5]
        xd = x * d + 2.0 * lens[6] * x * y + lens[7] * (r2 + 2.0 * x * x)
        yd = y * d + lens[6] * (r2 + 2.0 * y * y) + 2.0 * lens[7] * x * y
        r[2 * c] = (lens[0] * xd + lens[2] - uv[2 * c]) / sigma
        r[2 * c + 1] = (lens[1] * yd + lens[3] - uv[2 * c + 1]) / sigma
        mixed = 2.0 * (x * y * slope + lens[6] * x + lens[7] * y)
        xx = d + 2.0 * x * x * slope + 2.0 * lens[6] * y + 6.0 * lens[7] * x
        yy = d + 2.0 * y * y * slope + 6.0 * lens[6] * y + 2.0 * lens[7] * x
        fx, fy = lens[0] / sigma, lens[1] / sigma
        by[0, 0], by[0, 1], by[0, 2] = fx * xx / k[2], fx * mixed / k[2], -fx * (xx * x + mixed * y) / k[2]
        by[1, 0], by[1, 1], by[1, 2] = fy * mixed / k[2], fy * yy / k[2], -fy * (mixed * x + yy * y) / k[2]
        crossed(w, lm, dw)
        crossed(q, lv, dq)
        crossed(k, le, dk)
        for o in range(2):
            for i in range(3):  # back through the eye, then through the view
                inner[o, i] = by[o, 0] * re[i, 0] + by[o, 1] * re[i, 1] + by[o, 2] * re[i, 2]
            for i in range(3):
                world[o, i] = inner[o, 0] * rv[i, 0] + inner[o, 1] * rv[i, 1] + inner[o, 2] * rv[i, 2]
            at = (2 * c + o) * 6
            for i in range(3):
                jm[at + i], jv[at + i], je[at + i] = world[o, i], -world[o, i], -inner[o, i]
                a, b, e = 0.0, 0.0, 0.0
                for j in range(3):
                    a -= world[o, j] * dw[j, i]
                    b += inner[o, j] * dq[j, i]
                    e += by[o, j] * dk[j, i]
                jm[at + 3 + i], jv[at + 3 + i], je[at + 3 + i] = a, b, e
        at = 16 * c
        for i in range(16):
            jl[at + i] = 0.0
        jl[at], jl[at + 2] = xd / sigma, 1.0 / sigma
        jl[at + 4], jl[at + 5], jl[at + 6], jl[at + 7] = (
            fx * x * r2,
            fx * x * r2 * r2,
            2.0 * fx * x * y,
            fx * (r2 + 2.0 * x * x),
        )
        jl[at + 9], jl[at + 11] = yd / sigma, 1.0 / sigma
        jl[at + 12], jl[at + 13], jl[at + 14], jl[at + 15] = (
            fy * y * r2,
            fy * y * r2 * r2,
            fy * (r2 + 2.0 * y * y),
            2.0 * fy * x * y,
        )


@njit(cache=True)
def length(view, cable, tip, value, sigma, r, jv, jc):
    """A cable's length less its zero: r (1,), flat Jacobians by view (6,) and cable (4,)."""
    rv, lv, dw, w, g = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3), np.empty(3)
    rotation(view[3:], rv)
    left(view[3:], 1.0, lv)
    total = 0.0
    for i in range(3):
        w[i] = rv[i, 0] * tip[0] + rv[i, 1] * tip[1] + rv[i, 2] * tip[2]
        g[i] = w[i] + view[i] - cable[i]
        total += g[i] * g[i]
    full = math.sqrt(total)
    r[0] = (full - cable[3] - value) / sigma
    crossed(w, lv, dw)
    for i in range(3):
        e = g[i] / full / sigma
        jv[i], jc[i] = e, -e
        jv[3 + i] = 0.0
        for j in range(3):
            jv[3 + i] -= g[j] / full / sigma * dw[j, i]
    jc[3] = -1.0 / sigma


@njit(cache=True)
def rows_of(views, markers, eye, lens, cables, tips, view, marker, uv, value, corners, more, r, data):
    """All residuals, and the numbers of the sparse Jacobian: 26 a row of a sight (view, marker, eye, lens), 10 a length."""
    jv, je, jm, jl, jc = np.empty(48), np.empty(48), np.empty(48), np.empty(64), np.empty(4)
    at = 0
    for s in range(len(view)):
        sight(
            views[view[s]], eye, markers[marker[s]], lens, corners, uv[s], more[0], r[8 * s : 8 * s + 8], jv, je, jm, jl
        )
        for o in range(8):
            for i in range(6):
                data[at + i], data[at + 6 + i], data[at + 12 + i] = jv[6 * o + i], jm[6 * o + i], je[6 * o + i]
            for i in range(8):
                data[at + 18 + i] = jl[8 * o + i]
            at += 26
    first = 8 * len(view)
    for i in range(len(value)):
        length(views[i // 8], cables[i % 8], tips[i % 8], value[i], more[1], r[first + i : first + i + 1], jv, jc)
        for j in range(6):
            data[at + j] = jv[j]
        for j in range(4):
            data[at + 6 + j] = jc[j]
        at += 10


def turned(eye, mean):
    """What an eye is off its prior's mean: shift and rotation vector, (6,)."""
    a, b = np.empty((3, 3)), np.empty((3, 3))
    rotation(eye[3:], a)
    rotation(mean[3:], b)
    d = a @ b.T
    half = np.array([d[2, 1] - d[1, 2], d[0, 2] - d[2, 0], d[1, 0] - d[0, 1]]) / 2
    s = np.linalg.norm(half)
    angle = np.arctan2(s, (np.trace(d) - 1) / 2)
    return np.append(eye[:3] - mean[:3], half * (angle / s if s > 1e-12 else 1.0))


def eye_prior(eye, mean, root):
    """Whitened distance to the prior, (6,), and its Jacobian (6, 6), by central differences: it is met once an evaluation."""
    step = 1e-5 * np.eye(6)
    jac = np.column_stack([(turned(eye + h, mean) - turned(eye - h, mean)) / 2e-5 for h in step])
    return root @ turned(eye, mean), root @ jac
