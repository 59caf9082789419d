"""Elimination of one family of local blocks, block by block, and the way back."""

from __future__ import annotations

import numpy as np

from robocal._jit import kernel
from robocal.estimate._kernels import backward, cholesky, forward


@kernel
def fill(lam, a, g, damp, ak, gk, sk, damp_k, s, border, v):
    """The system of what is kept, before anything is eliminated: rows of blocks s (K, K), lower triangle, then those of free
    columns, border (n, K + n); v (K + n,)."""
    count, size = gk.shape
    n, base = g.shape[0], gk.shape[0] * gk.shape[1]
    for t in range(count):
        at = t * size
        for i in range(size):
            for j in range(i + 1):
                s[at + i, at + j] = ak[t, i, j]
            s[at + i, at + i] += lam * damp_k[t, i]
            v[at + i] = -gk[t, i]
            for p in range(n):
                border[p, at + i] = sk[t, p, i]
    for p in range(n):
        for q in range(p + 1):
            border[p, base + q] = a[p, q]
        border[p, base + p] += lam * damp[p]
        v[base + p] = -g[p]


@kernel
def subtract_square(y, width, at, row, base, s, border):
    """What is kept [at, at] -= y^T y, lower triangle, y (l, width) and at (width,) ascending, rows from `base` on in border; row (width,)
    is work space."""
    size = y.shape[0]
    for i in range(width):
        if size == 6:
            a, b, c, d, e, f = y[0, i], y[1, i], y[2, i], y[3, i], y[4, i], y[5, i]
            for j in range(i + 1):
                row[j] = a * y[0, j] + b * y[1, j] + c * y[2, j] + d * y[3, j] + e * y[4, j] + f * y[5, j]
        elif size == 3:
            a, b, c = y[0, i], y[1, i], y[2, i]
            for j in range(i + 1):
                row[j] = a * y[0, j] + b * y[1, j] + c * y[2, j]
        else:
            row[: i + 1] = 0.0
            for k in range(size):
                a = y[k, i]
                for j in range(i + 1):
                    row[j] += a * y[k, j]
        if at[i] >= base:
            out = border[at[i] - base]
            for j in range(i + 1):
                out[at[j]] -= row[j]
        else:
            for j in range(i + 1):
                s[at[i], at[j]] -= row[j]


@kernel
def eliminate(
    lam, first, base, start, slots, pair, slot, offset, ge, ae, se, damp_e, cross, s, border, v, root, half, store
):
    """Takes a family out of the system s, border, v of what is kept. Returns False when a block is not positive.

    `first` says whether it is the first family of the pairs; base is where the free columns begin. Block e meets the kept blocks
    slots[start[0, e] : start[0, e + 1]] through the entries start[1, e] : start[1, e + 1] of pair and slot (which slot of its own).
    root (E, l, l) and half (E, l) receive its factor L and -L^-1 g, store its L^-1 W, from offset[e], as rows of l.
    """
    count, size = ge.shape
    n, kept = se.shape[1], cross.shape[2] if first else cross.shape[1]
    most = 0
    for e in range(count):
        most = max(most, (start[0, e + 1] - start[0, e]) * kept + n)
    at, row = np.empty(most, np.int64), np.empty(most)
    met, room = np.empty(most, np.int64), np.empty(size * most)
    for e in range(count):
        block = root[e]
        for i in range(size):
            for j in range(i + 1):
                block[i, j] = ae[e, i, j]
            block[i, i] += lam * damp_e[e, i]
            half[e, i] = -ge[e, i]
        if not cholesky(block, size):
            return False
        forward(block, size, half[e])
        own = start[0, e + 1] - start[0, e]
        width = own * kept + n
        y = store[offset[e] : offset[e] + size * width].reshape(size, width)
        y[:, : own * kept] = 0.0
        for t in range(start[1, e], start[1, e + 1]):
            one, to = cross[pair[t]], slot[t] * kept
            for i in range(size):
                for j in range(kept):
                    y[i, to + j] += one[i, j] if first else one[j, i]
        for i in range(size):
            for p in range(n):
                y[i, own * kept + p] = se[e, p, i]
        for t in range(own):
            for j in range(kept):
                at[t * kept + j] = slots[start[0, e] + t] * kept + j
        for p in range(n):
            at[own * kept + p] = base + p
        for i in range(size):
            for k in range(i):
                f = block[i, k]
                for j in range(width):
                    y[i, j] -= f * y[k, j]
            f = 1.0 / block[i, i]
            for j in range(width):
                y[i, j] *= f
        for i in range(size):
            f = half[e, i]
            for j in range(width):
                v[at[j]] -= f * y[i, j]
        # Most free columns of many are touched by few blocks each.
        few = 0
        for j in range(width):
            touched = False
            for i in range(size):
                touched = touched or y[i, j] != 0.0
            if touched:
                met[few] = j
                few += 1
        if few == width:
            subtract_square(y, width, at, row, base, s, border)
            continue
        some = room[: size * few].reshape(size, few)
        for t in range(few):
            for i in range(size):
                some[i, t] = y[i, met[t]]
            met[t] = at[met[t]]
        subtract_square(some, few, met, row, base, s, border)
    return True


@kernel
def hold(held, base, border, v):
    """Free columns that must not move."""
    for p in range(held.shape[0]):
        if held[p]:
            border[p] = 0.0
            for q in range(p, held.shape[0]):
                border[q, base + p] = 0.0
            border[p, base + p] = 1.0
            v[base + p] = 0.0


@kernel
def back(base, start, slots, offset, root, half, store, kept, v, step):
    """The steps of the eliminated blocks (E, l) from those of what was kept, v."""
    count, size = half.shape
    n = v.shape[0] - base
    for e in range(count):
        own = start[0, e + 1] - start[0, e]
        width = own * kept + n
        y = store[offset[e] : offset[e] + size * width].reshape(size, width)
        for i in range(size):
            x = half[e, i]
            for t in range(own):
                at = slots[start[0, e] + t] * kept
                for j in range(kept):
                    x -= y[i, t * kept + j] * v[at + j]
            for p in range(n):
                x -= y[i, own * kept + p] * v[base + p]
            step[e, i] = x
        backward(root[e], size, step[e])
