"""Pose and Jacobian of a path of elementary transforms, for many parameter vectors and many rows at once.

Element kinds: 0 1 2 translate along x y z; 3 4 5 turn about x y z; 6 move along a constant screw (v, w); 7 a whole
frame. An element's value is constant + sum_t factor_t theta[parameter_t] phi[row, column_t] (column -1 reads as 1).
Everything that does not vary with the row is computed once per parameter vector.
"""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.geometry._kernels import rotation_from_vector


@kernel
def _screw(s, value, r, p):
    """r (9,), p (3,) <- exp(value * s) with s = (v, w)."""
    wx, wy, wz = s[3] * value, s[4] * value, s[5] * value
    vx, vy, vz = s[0] * value, s[1] * value, s[2] * value
    t2 = wx * wx + wy * wy + wz * wz
    if t2 < 1e-10:
        a = 1.0 - t2 / 6.0
        b = 0.5 - t2 / 24.0
        c = 1.0 / 6.0 - t2 / 120.0
    else:
        t = math.sqrt(t2)
        a = math.sin(t) / t
        half = math.sin(0.5 * t) / t
        b = 2.0 * half * half
        c = (1.0 - a) / t2
    r[0] = 1.0 - b * (wy * wy + wz * wz)
    r[4] = 1.0 - b * (wx * wx + wz * wz)
    r[8] = 1.0 - b * (wx * wx + wy * wy)
    r[1] = b * wx * wy - a * wz
    r[3] = b * wx * wy + a * wz
    r[2] = b * wx * wz + a * wy
    r[6] = b * wx * wz - a * wy
    r[5] = b * wy * wz - a * wx
    r[7] = b * wy * wz + a * wx
    # p = v + b w x v + c w x (w x v), the left Jacobian applied to v.
    ux, uy, uz = wy * vz - wz * vy, wz * vx - wx * vz, wx * vy - wy * vx
    p[0] = vx + b * ux + c * (wy * uz - wz * uy)
    p[1] = vy + b * uy + c * (wz * ux - wx * uz)
    p[2] = vz + b * uz + c * (wx * uy - wy * ux)


@kernel
def path_kernel(
    elements, constants, screws, start, terms, factor, theta, phi, trig, place, entries, entry_factor, first, pose, jac
):
    """Fills pose (B, M, 4, 4) and jac (B, M, 3 or 6, k); rows of jac are (v, w) of the end frame in base coordinates.

    elements (E, 2): kind, may vary with the row; terms (n, 2): parameter, column; entries (n, 5): element, component,
    output column, phi column or -1, parameter or -1. Row m of the output reads row first + m of phi; trig (1 or B, M,
    D, 2) holds cos and sin of the phi columns that place (C,) finds there, so that an ordinary joint, v = v0 + q or
    v0 - q, needs no sine of its own in every iteration. Entries of one element lie together: its screw is carried to
    the base once for all of them.
    """
    batch, rows = pose.shape[0], pose.shape[1]
    high, width = jac.shape[2], jac.shape[3]
    n = elements.shape[0]
    parameter = terms[:, 0]
    column = terms[:, 1]
    rate = np.empty(terms.shape[0])  # what a term's column is multiplied by
    # One allocation each for what elements have: a small problem is solved in the time of some hundred of them.
    room = np.zeros((n, 27))
    level = room[:, 0]  # what does not vary with the row
    cosine, sine = room[:, 1], room[:, 2]
    fixed_r, fixed_p = room[:, 3:12], room[:, 12:15]
    before, at = room[:, 15:24], room[:, 24:27]
    marks = np.zeros((n, 6), np.int64)
    skip = marks[:, 0]  # the identity: nothing to multiply
    shift = marks[:, 1]  # a frame that does not turn
    wanted = marks[:, 2]
    plain = marks[:, 3]  # +1 or -1 for an ordinary turning joint
    drive = marks[:, 4]  # and the column that drives it
    until = marks[:, 5]  # where the live terms of an element end
    live = np.empty(terms.shape[0], np.int64)  # terms that vary with the row: one times zero is nothing
    count = entries.shape[0]
    axis = np.empty(
        (count, 2), np.int64
    )  # which motion an entry is, the element's kind or the component of a frame; and
    share = np.empty(count)  # what an entry's motion is multiplied by, but for the row
    known, new = np.zeros(width, np.int64), 0  # whether it is the first of its column
    for i in range(count):
        e = entries[i, 0]
        wanted[e] = 1
        axis[i, 0] = entries[i, 1] if elements[e, 0] == 7 else elements[e, 0]
        axis[i, 1] = 1 - known[entries[i, 2]]
        known[entries[i, 2]] = 1
        new += axis[i, 1]
    matrix = np.zeros((3, 3))
    nr = np.zeros(9)
    for b in range(batch):
        bp = b if phi.shape[0] > 1 else 0
        for e in range(n):
            kind = elements[e, 0]
            moving = 0
            gain = 0.0
            level[e] = constants[e]
            plain[e] = 0
            for t in range(start[e], start[e + 1]):
                rate[t] = factor[t] * theta[b, parameter[t]]
                if column[t] < 0:
                    level[e] += rate[t]
                elif rate[t] != 0.0:
                    live[start[e] + moving] = t
                    moving += 1
                    gain = rate[t]
                    drive[e] = place[column[t]]
            until[e] = start[e] + moving
            if moving > 0:
                if 3 <= kind < 6 and moving == 1 and abs(gain) == 1.0 and drive[e] >= 0:
                    plain[e] = 1 if gain > 0.0 else -1
                    cosine[e] = math.cos(level[e])
                    sine[e] = math.sin(level[e])
                continue
            if kind == 7:
                s = start[e]
                rotation_from_vector(
                    theta[b, parameter[s + 3]], theta[b, parameter[s + 4]], theta[b, parameter[s + 5]], matrix
                )
                moved = 0.0
                turned = 0.0
                for i in range(3):
                    fixed_p[e, i] = theta[b, parameter[s + i]]
                    moved += abs(fixed_p[e, i])
                    turned += abs(theta[b, parameter[s + 3 + i]])
                    for j in range(3):
                        fixed_r[e, 3 * i + j] = matrix[i, j]
                shift[e] = 1 if turned == 0.0 else 0
                skip[e] = 1 if turned == 0.0 and moved == 0.0 else 0
                continue
            value = level[e]
            skip[e] = 1 if value == 0.0 else 0
            if kind < 3:
                cosine[e] = value
            elif kind < 6:
                cosine[e] = math.cos(value)
                sine[e] = math.sin(value)
            else:
                _screw(screws[e], value, fixed_r[e], fixed_p[e])
        for i in range(count):
            share[i] = entry_factor[i]
            if entries[i, 4] >= 0:
                share[i] *= theta[b, entries[i, 4]]
        for m in range(rows):
            r0, r1, r2, r3, r4, r5, r6, r7, r8 = 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
            px, py, pz = 0.0, 0.0, 0.0
            for e in range(n):
                kind = elements[e, 0]
                varies = until[e] > start[e]
                if wanted[e] == 1:
                    # Where the element starts: its screw, seen from the base, is all that the Jacobian needs.
                    before[e, 0], before[e, 1], before[e, 2] = r0, r1, r2
                    before[e, 3], before[e, 4], before[e, 5] = r3, r4, r5
                    before[e, 6], before[e, 7], before[e, 8] = r6, r7, r8
                    at[e, 0], at[e, 1], at[e, 2] = px, py, pz
                if plain[e] != 0:
                    cq = trig[bp, first + m, drive[e], 0]
                    sq = plain[e] * trig[bp, first + m, drive[e], 1]
                    c = cosine[e] * cq - sine[e] * sq
                    s = sine[e] * cq + cosine[e] * sq
                elif varies:
                    value = level[e]
                    for k in range(start[e], until[e]):
                        value += rate[live[k]] * phi[bp, first + m, column[live[k]]]
                    if kind < 3:
                        c = value
                        s = 0.0
                    elif kind < 6:
                        c = math.cos(value)
                        s = math.sin(value)
                    else:
                        c = 0.0
                        s = 0.0
                        _screw(screws[e], value, fixed_r[e], fixed_p[e])
                elif skip[e] == 1:
                    continue
                else:
                    c = cosine[e]
                    s = sine[e]
                if kind == 0:
                    px += c * r0
                    py += c * r3
                    pz += c * r6
                elif kind == 1:
                    px += c * r1
                    py += c * r4
                    pz += c * r7
                elif kind == 2:
                    px += c * r2
                    py += c * r5
                    pz += c * r8
                elif kind == 3:
                    r1, r2 = c * r1 + s * r2, c * r2 - s * r1
                    r4, r5 = c * r4 + s * r5, c * r5 - s * r4
                    r7, r8 = c * r7 + s * r8, c * r8 - s * r7
                elif kind == 4:
                    r0, r2 = c * r0 - s * r2, c * r2 + s * r0
                    r3, r5 = c * r3 - s * r5, c * r5 + s * r3
                    r6, r8 = c * r6 - s * r8, c * r8 + s * r6
                elif kind == 5:
                    r0, r1 = c * r0 + s * r1, c * r1 - s * r0
                    r3, r4 = c * r3 + s * r4, c * r4 - s * r3
                    r6, r7 = c * r6 + s * r7, c * r7 - s * r6
                else:
                    f = fixed_r[e]
                    x, y, z = fixed_p[e, 0], fixed_p[e, 1], fixed_p[e, 2]
                    px += r0 * x + r1 * y + r2 * z
                    py += r3 * x + r4 * y + r5 * z
                    pz += r6 * x + r7 * y + r8 * z
                    if kind == 7:
                        # A frame turns about its own origin, so its lever starts after its translation.
                        at[e, 0], at[e, 1], at[e, 2] = px, py, pz
                        if shift[e] == 1:
                            continue
                    for j in range(3):
                        nr[j] = r0 * f[j] + r1 * f[3 + j] + r2 * f[6 + j]
                        nr[3 + j] = r3 * f[j] + r4 * f[3 + j] + r5 * f[6 + j]
                        nr[6 + j] = r6 * f[j] + r7 * f[3 + j] + r8 * f[6 + j]
                    r0, r1, r2, r3, r4, r5, r6, r7, r8 = (
                        nr[0], nr[1], nr[2], nr[3], nr[4], nr[5], nr[6], nr[7], nr[8],
                    )  # fmt: skip
            t = pose[b, m]
            t[0, 0], t[0, 1], t[0, 2], t[0, 3] = r0, r1, r2, px
            t[1, 0], t[1, 1], t[1, 2], t[1, 3] = r3, r4, r5, py
            t[2, 0], t[2, 1], t[2, 2], t[2, 3] = r6, r7, r8, pz
            t[3, 0], t[3, 1], t[3, 2], t[3, 3] = 0.0, 0.0, 0.0, 1.0
            if width == 0:
                continue
            out = jac[b, m]
            if new < width:
                out[:] = 0.0
            element = -1
            part = -1
            vx, vy, vz, wx, wy, wz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for i in range(count):
                e = entries[i, 0]
                kind = axis[i, 0]
                if e != element or kind != part:
                    element = e
                    part = kind
                    q = before[e]
                    if kind < 3:
                        vx, vy, vz = q[kind], q[3 + kind], q[6 + kind]
                        wx, wy, wz = 0.0, 0.0, 0.0
                    else:
                        if kind < 6:
                            wx, wy, wz = q[kind - 3], q[kind], q[3 + kind]
                            vx, vy, vz = 0.0, 0.0, 0.0
                        else:
                            g = screws[e]
                            wx = q[0] * g[3] + q[1] * g[4] + q[2] * g[5]
                            wy = q[3] * g[3] + q[4] * g[4] + q[5] * g[5]
                            wz = q[6] * g[3] + q[7] * g[4] + q[8] * g[5]
                            vx = q[0] * g[0] + q[1] * g[1] + q[2] * g[2]
                            vy = q[3] * g[0] + q[4] * g[1] + q[5] * g[2]
                            vz = q[6] * g[0] + q[7] * g[1] + q[8] * g[2]
                        lx, ly, lz = px - at[e, 0], py - at[e, 1], pz - at[e, 2]
                        vx += wy * lz - wz * ly
                        vy += wz * lx - wx * lz
                        vz += wx * ly - wy * lx
                col = entries[i, 2]
                f = share[i]
                if entries[i, 3] >= 0:
                    f *= phi[bp, first + m, entries[i, 3]]
                if axis[i, 1] == 1:
                    out[0, col], out[1, col], out[2, col] = f * vx, f * vy, f * vz
                    if high == 6:
                        out[3, col], out[4, col], out[5, col] = f * wx, f * wy, f * wz
                    continue
                out[0, col] += f * vx
                out[1, col] += f * vy
                out[2, col] += f * vz
                if high == 6:
                    out[3, col] += f * wx
                    out[4, col] += f * wy
                    out[5, col] += f * wz
