"""Compiled rotation arithmetic on plain arrays; callers own every buffer."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel

COARSE = 4  # rounds of the coarse way, before Newton's
NEAR = 0.5  # rad: a turn by more leads to another valley
ARRIVED = 1e-8  # rad: after a step of Newton's by less the next one is rounding


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


@kernel
def pose_gaps(t, jac, point, turn, which, reach, gap, angle):
    """gap (m, 6) <- (p - p*, reach log(R R*^T)) of frames t (m, 4, 4) from point (M, 3) and turn (M, 3, 3), number which (m,), angle (m,)
    <- that of the turn; the angular rows of jac (m, 6, n) become those of gap."""
    both, inverse, w = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for m in range(t.shape[0]):
        r, goal, j = t[m], turn[which[m]], jac[m]
        for i in range(3):
            gap[m, i] = r[i, 3] - point[which[m], i]
            for k in range(3):
                both[i, k] = r[i, 0] * goal[k, 0] + r[i, 1] * goal[k, 1] + r[i, 2] * goal[k, 2]
        vector_from_rotation(both, w)
        left_inverse(w, inverse)
        angle[m] = math.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
        for i in range(3):
            gap[m, 3 + i] = reach * w[i]
        for k in range(jac.shape[2]):
            x, y, z = reach * j[3, k], reach * j[4, k], reach * j[5, k]
            for i in range(3):
                j[3 + i, k] = inverse[i, 0] * x + inverse[i, 1] * y + inverse[i, 2] * z


@kernel
def nearest_rotation(m, a, v, out):
    """out (3, 3) <- the rotation nearest to m (9,), which has the largest sum R_ij M_ij: that of the quaternion that is the widest
    axis of a symmetric matrix, found by Jacobi's turns. a and v (4, 4) are work space. Source: Horn (1987)."""
    a[0, 0], a[1, 1] = m[0] + m[4] + m[8], m[0] - m[4] - m[8]
    a[2, 2], a[3, 3] = m[4] - m[0] - m[8], m[8] - m[0] - m[4]
    a[0, 1], a[0, 2], a[0, 3] = m[7] - m[5], m[2] - m[6], m[3] - m[1]
    a[1, 2], a[1, 3], a[2, 3] = m[1] + m[3], m[2] + m[6], m[5] + m[7]
    size = 0.0
    for i in range(4):
        for j in range(4):
            v[i, j] = 1.0 if i == j else 0.0
        for j in range(i, 4):
            size += a[i, j] * a[i, j]
    for _ in range(12):
        left = 0.0
        for i in range(3):
            for j in range(i + 1, 4):
                left += a[i, j] * a[i, j]
        if left <= 1e-34 * size:
            break
        for p in range(3):
            for q in range(p + 1, 4):
                if a[p, q] == 0.0:
                    continue
                half = (a[q, q] - a[p, p]) / (2.0 * a[p, q])
                t = 1.0 / (abs(half) + math.sqrt(half * half + 1.0))
                t = t if half >= 0.0 else -t
                c = 1.0 / math.sqrt(t * t + 1.0)
                s = t * c
                a[p, p] -= t * a[p, q]
                a[q, q] += t * a[p, q]
                a[p, q] = 0.0
                for k in range(4):
                    if k != p and k != q:
                        x, y = a[min(k, p), max(k, p)], a[min(k, q), max(k, q)]
                        a[min(k, p), max(k, p)], a[min(k, q), max(k, q)] = c * x - s * y, s * x + c * y
                    x, y = v[k, p], v[k, q]
                    v[k, p], v[k, q] = c * x - s * y, s * x + c * y
    best = 0
    for i in range(1, 4):
        if a[i, i] > a[best, best]:
            best = i
    w, x, y, z = v[0, best], v[1, best], v[2, best], v[3, best]
    n = 2.0 / (w * w + x * x + y * y + z * z)
    out[0, 0], out[0, 1], out[0, 2] = 1.0 - n * (y * y + z * z), n * (x * y - w * z), n * (x * z + w * y)
    out[1, 0], out[1, 1], out[1, 2] = n * (x * y + w * z), 1.0 - n * (x * x + z * z), n * (y * z - w * x)
    out[2, 0], out[2, 1], out[2, 2] = n * (x * z - w * y), n * (y * z + w * x), 1.0 - n * (x * x + y * y)


@kernel
def turn_until_still(step, rotations, rounds, still):
    """rotations (S, B, 3, 3), in place: to where r^T M r is largest, M = step (S, 9, 9), r the numbers of R. First R <- the rotation
    nearest to M r, which finds the valley, then Newton's steps; so often, or until none of its numbers moves by more than `still`."""
    m, now, a, v, w = np.empty(9), np.empty((3, 3)), np.empty((4, 4)), np.empty((4, 4)), np.empty(3)
    turned, bent, spin = np.empty((3, 9)), np.empty((3, 3)), np.empty((3, 3))
    for s in range(rotations.shape[0]):
        for b in range(rotations.shape[1]):
            r = rotations[s, b]
            for turn in range(rounds):
                for i in range(9):
                    total = 0.0
                    for j in range(9):
                        total += step[s, i, j] * r[j // 3, j % 3]
                    m[i] = total
                fine = turn >= COARSE and newton_turn(step[s], r, m, turned, bent, w)
                if fine:
                    rotation_from_vector(w[0], w[1], w[2], spin)
                    for i in range(3):
                        for j in range(3):
                            now[i, j] = spin[i, 0] * r[0, j] + spin[i, 1] * r[1, j] + spin[i, 2] * r[2, j]
                else:
                    nearest_rotation(m, a, v, now)
                moved = 0.0
                for i in range(3):
                    for j in range(3):
                        moved = max(moved, abs(now[i, j] - r[i, j]))
                        r[i, j] = now[i, j]
                if not moved > (ARRIVED if fine else still):
                    break


@kernel
def newton_turn(step, r, m, turned, bent, w):
    """w (3,) <- the turn exp(w) R by which Newton raises r^T M r, where m = M r; whether it leads up, and not far. turned (3, 9) and bent
    (3, 3) are work space. With D_k = [e_k] R and N = m R^T:  g_k = <D_k, m>,  H_kl = <D_k, M D_l> + (N_kl + N_lk) / 2 - d_kl tr N."""
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        for c in range(3):
            turned[k, 3 * k + c], turned[k, 3 * i + c], turned[k, 3 * j + c] = 0.0, -r[j, c], r[i, c]
    trace = 0.0
    for i in range(9):
        trace += m[i] * r[i // 3, i % 3]
    for l in range(3):
        gradient = 0.0
        for i in range(9):
            gradient += turned[l, i] * m[i]
        w[l] = gradient
        for k in range(l + 1):
            total = trace if k == l else 0.0
            for c in range(3):
                total -= 0.5 * (m[3 * k + c] * r[l, c] + m[3 * l + c] * r[k, c])
            for i in range(9):
                row = 0.0
                for j in range(9):
                    row += step[i, j] * turned[l, j]
                total -= turned[k, i] * row
            bent[l, k] = total
    for l in range(3):  # Cholesky's root of -H
        for k in range(l + 1):
            total = bent[l, k]
            for i in range(k):
                total -= bent[l, i] * bent[k, i]
            if k < l:
                bent[l, k] = total / bent[k, k]
            elif total <= 1e-12 * trace:
                return False
            else:
                bent[l, l] = math.sqrt(total)
    for l in range(3):
        for i in range(l):
            w[l] -= bent[l, i] * w[i]
        w[l] /= bent[l, l]
    for k in range(2, -1, -1):
        for i in range(k + 1, 3):
            w[k] -= bent[i, k] * w[i]
        w[k] /= bent[k, k]
    return w[0] * w[0] + w[1] * w[1] + w[2] * w[2] < NEAR * NEAR
