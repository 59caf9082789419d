"""Compiled rotation arithmetic on plain arrays; callers own every buffer."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel


@kernel
def rotation_from_vector(x, y, z, out):
    """Rodrigues: out (3, 3) <- exp of the rotation vector (x, y, z)."""
    angle2 = x * x + y * y + z * z
    if angle2 < 1e-12:
        # Series to second order: the error is of order angle^3, below 1e-18.
        s = 1.0 - angle2 / 6.0
        c = 0.5 - angle2 / 24.0
    else:
        angle = math.sqrt(angle2)
        s = math.sin(angle) / angle
        half = math.sin(0.5 * angle) / angle
        c = 2.0 * half * half
    out[0, 0] = 1.0 - c * (y * y + z * z)
    out[1, 1] = 1.0 - c * (x * x + z * z)
    out[2, 2] = 1.0 - c * (x * x + y * y)
    out[0, 1] = c * x * y - s * z
    out[1, 0] = c * x * y + s * z
    out[0, 2] = c * x * z + s * y
    out[2, 0] = c * x * z - s * y
    out[1, 2] = c * y * z - s * x
    out[2, 1] = c * y * z + s * x


@kernel
def vector_from_rotation(r, out):
    """out (3,) <- log of the rotation r (3, 3), angle in [0, pi], through the quaternion, exact near pi as well."""
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    if trace > 0.0:
        s = 2.0 * math.sqrt(1.0 + trace)
        w = 0.25 * s
        x = (r[2, 1] - r[1, 2]) / s
        y = (r[0, 2] - r[2, 0]) / s
        z = (r[1, 0] - r[0, 1]) / s
    elif r[0, 0] >= r[1, 1] and r[0, 0] >= r[2, 2]:
        s = 2.0 * math.sqrt(max(1.0 + r[0, 0] - r[1, 1] - r[2, 2], 0.0))
        w = (r[2, 1] - r[1, 2]) / s
        x = 0.25 * s
        y = (r[0, 1] + r[1, 0]) / s
        z = (r[0, 2] + r[2, 0]) / s
    elif r[1, 1] >= r[2, 2]:
        s = 2.0 * math.sqrt(max(1.0 + r[1, 1] - r[0, 0] - r[2, 2], 0.0))
        w = (r[0, 2] - r[2, 0]) / s
        x = (r[0, 1] + r[1, 0]) / s
        y = 0.25 * s
        z = (r[1, 2] + r[2, 1]) / s
    else:
        s = 2.0 * math.sqrt(max(1.0 + r[2, 2] - r[0, 0] - r[1, 1], 0.0))
        w = (r[1, 0] - r[0, 1]) / s
        x = (r[0, 2] + r[2, 0]) / s
        y = (r[1, 2] + r[2, 1]) / s
        z = 0.25 * s
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    norm = math.sqrt(x * x + y * y + z * z)
    factor = 2.0 / w if norm < 1e-12 else 2.0 * math.atan2(norm, w) / norm
    out[0] = factor * x
    out[1] = factor * y
    out[2] = factor * z


@kernel
def turn_vectors(values, at, step, columns):
    """Steps rotation vectors on the group, in place: values[b, at[i]:at[i]+3] <- log(exp(step) exp(value)), of whose values the one
    nearest to what was there: a vector never jumps from half a turn to minus half a turn.

    values (B, P), at (k,), step (B, n), columns (k, 3): the tangent column of each component, or -1 when it is held.
    """
    left = np.empty((3, 3))
    right = np.empty((3, 3))
    both = np.empty((3, 3))
    for b in range(values.shape[0]):
        for i in range(at.shape[0]):
            p = at[i]
            wx = step[b, columns[i, 0]] if columns[i, 0] >= 0 else 0.0
            wy = step[b, columns[i, 1]] if columns[i, 1] >= 0 else 0.0
            wz = step[b, columns[i, 2]] if columns[i, 2] >= 0 else 0.0
            if wx == 0.0 and wy == 0.0 and wz == 0.0:
                continue
            rotation_from_vector(wx, wy, wz, left)
            rotation_from_vector(values[b, p], values[b, p + 1], values[b, p + 2], right)
            for r in range(3):
                for c in range(3):
                    both[r, c] = left[r, 0] * right[0, c] + left[r, 1] * right[1, c] + left[r, 2] * right[2, c]
            before_x, before_y, before_z = values[b, p], values[b, p + 1], values[b, p + 2]
            vector_from_rotation(both, values[b, p : p + 3])
            angle = math.sqrt(values[b, p] ** 2 + values[b, p + 1] ** 2 + values[b, p + 2] ** 2)
            if angle > 0.5 * math.pi:  # below, all others are farther, unless a step is half a turn
                along = (before_x * values[b, p] + before_y * values[b, p + 1] + before_z * values[b, p + 2]) / angle
                whole = 2.0 * math.pi * math.floor((along - angle) / (2.0 * math.pi) + 0.5)
                for r in range(3):
                    values[b, p + r] *= 1.0 + whole / angle


@kernel
def add_step(values, step, at, columns, rows, adds):
    """Moves values (B, P) by a tangent step (B, n), in place: numbers rows (k,) by the columns adds (k,), rotation vectors as
    `turn_vectors` does."""
    for b in range(values.shape[0]):
        for i in range(rows.shape[0]):
            values[b, rows[i]] += step[b, adds[i]]
    if at.shape[0] > 0:
        turn_vectors(values, at, step, columns)


@kernel
def step_between(values, mean, at, columns, rows, adds, out):
    """out (B, n) <- the tangent step from mean (P,) to values (B, P): what `add_step` takes; a held component is left out."""
    left = np.empty((3, 3))
    right = np.empty((3, 3))
    both = np.empty((3, 3))
    w = np.empty(3)
    for b in range(values.shape[0]):
        for i in range(rows.shape[0]):
            out[b, adds[i]] = values[b, rows[i]] - mean[rows[i]]
        for i in range(at.shape[0]):
            p = at[i]
            rotation_from_vector(values[b, p], values[b, p + 1], values[b, p + 2], left)
            rotation_from_vector(mean[p], mean[p + 1], mean[p + 2], right)
            for r in range(3):
                for c in range(3):
                    both[r, c] = left[r, 0] * right[c, 0] + left[r, 1] * right[c, 1] + left[r, 2] * right[c, 2]
            vector_from_rotation(both, w)
            for k in range(3):
                if columns[i, k] >= 0:
                    out[b, columns[i, k]] = w[k]


@kernel
def left_inverse(w, out):
    """out (3, 3) <- the inverse of the left Jacobian of the rotation vector w, I - [w] / 2 + e [w]^2."""
    n2 = w[0] * w[0] + w[1] * w[1] + w[2] * w[2]
    if n2 < 1e-6:
        e = 1.0 / 12.0 + n2 / 720.0
    else:
        h = 0.5 * math.sqrt(n2)
        e = (1.0 - h * math.cos(h) / math.sin(h)) / n2
    for i in range(3):
        for j in range(3):
            out[i, j] = e * w[i] * w[j]
        out[i, i] += 1.0 - e * n2
    out[0, 1] += 0.5 * w[2]
    out[0, 2] -= 0.5 * w[1]
    out[1, 0] -= 0.5 * w[2]
    out[1, 2] += 0.5 * w[0]
    out[2, 0] += 0.5 * w[1]
    out[2, 1] -= 0.5 * w[0]
