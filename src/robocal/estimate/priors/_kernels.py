"""Compiled rows of priors in the normal equations, and how much of a fit they pay for."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.estimate._kernels import cholesky
from robocal.geometry._kernels import left_inverse, rotation_from_vector, vector_from_rotation


@kernel
def held_by(a, root):
    """Trace of A^-1 R^T R of a (n, n), lower triangle, and root (n, n); a is overwritten. The smallest pivot of A with a diagonal of
    ones comes beside it, below zero where A is not positive definite."""
    n = a.shape[0]
    size, v = np.empty(n), np.empty(n)
    for i in range(n):
        if not a[i, i] > 0.0:
            return 0.0, -1.0
        size[i] = 1.0 / math.sqrt(a[i, i])
    for i in range(n):
        for j in range(i + 1):
            a[i, j] *= size[i] * size[j]
    if not cholesky(a, n):
        return 0.0, -1.0
    trace, least = 0.0, 1.0
    for i in range(n):
        least = min(least, a[i, i] * a[i, i])
    for k in range(n):
        first = n  # a prior of its own, the ordinary case, has one number in its row
        for i in range(n - 1, -1, -1):
            v[i] = root[k, i] * size[i]
            if v[i] != 0.0:
                first = i
        for i in range(first, n):
            s = v[i]
            for j in range(first, i):
                s -= a[i, j] * v[j]
            v[i] = s / a[i, i]
            trace += v[i] * v[i]
    return trace, least


@kernel
def add_pull(root, information, d, cost, g, a):
    """Adds the rows R d of priors: root (n, n), its information in the lower triangle, d (B, n) the step from the means."""
    n = root.shape[0]
    for b in range(d.shape[0]):
        for i in range(n):
            along = 0.0
            for j in range(n):
                along += root[i, j] * d[b, j]
            if along != 0.0:
                cost[b] += 0.5 * along * along
                for j in range(n):
                    g[b, j] += along * root[i, j]
            for j in range(i + 1):
                a[b, i, j] += information[i, j]


@kernel
def add_block_priors(x, start, root, axes, cost, g, a):
    """Adds the priors of local blocks: x (B, L w) their values, start (L, w), root (L, l, l), axes (l,); cost (B,), g (B, L, l),
    a (B, L, l, l). The logarithm of the turn from the start answers to a further turn with its left Jacobian, inverted."""
    count, width = start.shape
    size = axes.shape[0]
    e, r = np.empty(width), np.empty(size)
    now, turn, w = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    inverse, slope, rows = np.empty((3, 3)), np.zeros((width, width)), np.empty((size, size))
    before = np.empty((count, 3, 3))
    for t in range(count):
        if width == 6:
            rotation_from_vector(start[t, 3], start[t, 4], start[t, 5], before[t])
    for b in range(x.shape[0]):
        for t in range(count):
            for i in range(width):
                e[i] = x[b, t * width + i] - start[t, i]
                slope[i, i] = 1.0
            if width == 6:
                at, then = t * width + 3, before[t]
                rotation_from_vector(x[b, at], x[b, at + 1], x[b, at + 2], now)
                for i in range(3):
                    for j in range(3):
                        turn[i, j] = now[i, 0] * then[j, 0] + now[i, 1] * then[j, 1] + now[i, 2] * then[j, 2]
                vector_from_rotation(turn, w)
                left_inverse(w, inverse)
                for i in range(3):
                    e[3 + i] = w[i]
                    for j in range(3):
                        slope[3 + i, 3 + j] = inverse[i, j]
            for i in range(size):
                s = 0.0
                rows[i] = 0.0
                for j in range(size):
                    f = root[t, i, j]
                    if f != 0.0:
                        s += f * e[axes[j]]
                        for k in range(size):
                            rows[i, k] += f * slope[axes[j], axes[k]]
                r[i] = s
                cost[b] += 0.5 * s * s
            for i in range(size):
                for k in range(size):
                    f = rows[i, k]
                    if f != 0.0:
                        g[b, t, k] += f * r[i]
                        for j in range(size):
                            a[b, t, k, j] += f * rows[i, j]
