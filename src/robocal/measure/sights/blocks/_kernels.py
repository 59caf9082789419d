"""Corners whose errors are correlated, in compiled code: numbers of a block are made independent by its matrix, mixing (U, 8, 8), whose
rows are those of its corners that are used, in their order; block (m,) says which block a row is of."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.estimate._kernels import kept, robust
from robocal.measure.sights.points._kernels import BY_U, BY_V, FLAT_X, FLAT_Y, SHARE, TILE, UX, U, V, whiten_points

CORNERS = 4  # of a block, at most


@kernel
def mix_rows(values, first, used, block, mixing):
    """values (B, n, 2, k), in place: rows of whole blocks, from the row `first` on."""
    batch, n, k = values.shape[0], values.shape[1], values.shape[3]
    at, left = np.empty(CORNERS, np.int64), np.empty((2 * CORNERS, k))
    for b in range(batch):
        i = 0
        while i < n:
            h, here = 0, block[first + i]
            while i < n and block[first + i] == here:
                if used[first + i]:
                    at[h] = i
                    h += 1
                i += 1
            for j in range(2 * h):
                left[j] = values[b, at[j // 2], j % 2]
            for j in range(2 * h):
                row = values[b, at[j // 2], j % 2]
                row[:] = 0.0
                for o in range(2 * h):
                    f = mixing[here, j, o]
                    for p in range(k):
                        row[p] += f * left[o, p]


@kernel
def count_block(rows, first, n, block):
    """How many of rows (n,), from `first` on, are of its block."""
    h = 1
    while first + h < n and block[rows[first + h]] == block[rows[first]]:
        h += 1
    return h


@kernel
def whiten_blocks(rows, n, value, scale, block, mixing, heavy, loss, tuning, curved, w, roots):
    """As `whiten_points`, of n points of whole blocks; roots (TILE,) <- the root of each point's weight, which derivatives do not have yet.
    Without matrices that is all."""
    if mixing.shape[0] == 0:
        return whiten_points(rows, n, value, scale, heavy, loss, tuning, curved, w)
    total, i = 0.0, 0
    left = np.empty(2 * CORNERS)
    while i < n:
        h = count_block(rows, i, n, block)
        matrix = mixing[block[rows[i]]]
        for j in range(h):
            left[2 * j], left[2 * j + 1] = w[U + i + j] - value[rows[i + j], 0], w[V + i + j] - value[rows[i + j], 1]
        for j in range(h):
            x = y = 0.0
            for o in range(2 * h):
                x += matrix[2 * j, o] * left[o]
                y += matrix[2 * j + 1, o] * left[o]
            x, y = x * scale[rows[i + j], 0], y * scale[rows[i + j], 1]
            rho, slope = robust(loss, tuning, x * x + y * y)
            total += rho
            root = math.sqrt(heavy * slope)
            if root == 0.0:
                x, y, w[FLAT_X + i + j], w[FLAT_Y + i + j] = 0.0, 0.0, 0.0, 0.0
                for e in range(6):
                    w[UX + e * TILE + i + j] = 0.0
            w[U + i + j], w[V + i + j], w[BY_U + i + j], w[BY_V + i + j] = root * x, root * y, 1.0, 1.0
            roots[i + j] = root
            if curved:
                w[SHARE + i + j] = kept(loss, tuning, x * x + y * y)
        i += h
    return total


@kernel
def mix_points(rows, n, scale, block, mixing, roots, size, heap):
    """Derivatives of n points of whole blocks, `size` columns of `heap`, made independent, whitened and weighed."""
    left, i = np.empty(2 * CORNERS), 0
    while i < n:
        h = count_block(rows, i, n, block)
        matrix = mixing[block[rows[i]]]
        for p in range(size):
            for j in range(h):
                left[2 * j], left[2 * j + 1] = heap[p, i + j], heap[p, n + i + j]
            for j in range(h):
                x = y = 0.0
                for o in range(2 * h):
                    x += matrix[2 * j, o] * left[o]
                    y += matrix[2 * j + 1, o] * left[o]
                heap[p, i + j] = x * scale[rows[i + j], 0] * roots[i + j]
                heap[p, n + i + j] = y * scale[rows[i + j], 1] * roots[i + j]
        i += h
