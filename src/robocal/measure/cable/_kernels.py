"""Compiled residuals of measured cable lengths, straight or over pulleys, and their normal equations."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.cables.balance._kernels import length_of
from robocal.estimate._kernels import add_block, add_shared_columns, kept, robust

NUMBERS = 7  # of a cable: where its anchors are on the frame and on the platform, and the zero of its length


@kernel
def slopes_of(t, numbers, radius, axis, share, sight, place, cable, length, slope):
    """Of every row: length (m,) of its cable less its zero, and slope (m, 9): by the pose, (v, w), and by the platform anchor.

    t (S, 4, 4), numbers (N, 7), sight (m,), place (m,) which of the numbers and cable (m,) which pulley; share (m,) is what stretch
    leaves of a geometric length, times how often it counts. By the frame anchor it is -v, by the zero -1.
    """
    u = np.empty(3)
    for i in range(sight.shape[0]):
        s, c, n = sight[i], cable[i], place[i]
        px, py, pz = numbers[n, 3], numbers[n, 4], numbers[n, 5]
        lx = t[s, 0, 0] * px + t[s, 0, 1] * py + t[s, 0, 2] * pz
        ly = t[s, 1, 0] * px + t[s, 1, 1] * py + t[s, 1, 2] * pz
        lz = t[s, 2, 0] * px + t[s, 2, 1] * py + t[s, 2, 2] * pz
        dx, dy, dz = t[s, 0, 3] + lx - numbers[n, 0], t[s, 1, 3] + ly - numbers[n, 1], t[s, 2, 3] + lz - numbers[n, 2]
        if radius[c] == 0.0:
            full = math.sqrt(dx * dx + dy * dy + dz * dz)
            f = 1.0 / full if full > 0.0 else 0.0
            ux, uy, uz = f * dx, f * dy, f * dz
        else:
            full = length_of(dx, dy, dz, radius[c], axis[c], u)
            ux, uy, uz = u[0], u[1], u[2]
        f = share[i]
        length[i] = f * full - numbers[n, 6]
        ux, uy, uz = f * ux, f * uy, f * uz
        slope[i, 0], slope[i, 1], slope[i, 2] = ux, uy, uz
        slope[i, 3], slope[i, 4], slope[i, 5] = ly * uz - lz * uy, lz * ux - lx * uz, lx * uy - ly * ux
        for o in range(3):
            slope[i, 6 + o] = t[s, 0, o] * ux + t[s, 1, o] * uy + t[s, 2, o] * uz


@kernel
def evaluate_lengths(
    t, jac, jloc, numbers, radius, axis, share, sight, place, cable, row, edges, symbol, value, r, out, out_local
):  # fmt: skip
    """Residuals r (B, m, 1) and Jacobians out (B, m, 1, k + c) and out_local (B, m, 1, l), zero before; each is the sum over segments
    (p,) of what they see, row (p,) saying of which it is a part. The rest is as in `accumulate_lengths`, of segments for rows."""
    batch, k, nl, rows = t.shape[0], jac.shape[3], jloc.shape[3], sight.shape[0]
    length, slope, number = np.empty(rows), np.empty((rows, 9)), np.zeros(NUMBERS + 1)
    for b in range(batch):
        vb = b if value.shape[0] > 1 else 0
        slopes_of(t[b], numbers[b], radius, axis, share, sight, place, cable, length, slope)
        for m in range(r.shape[1]):
            r[b, m, 0] = -value[vb, m, 0]
        for i in range(rows):
            c, s, m = cable[i], sight[i], row[i]
            r[b, m, 0] += length[i]
            for p in range(k):
                for o in range(6):
                    out[b, m, 0, p] += slope[i, o] * jac[b, s, o, p]
            by_numbers(1.0, slope[i], number)
            for e in range(edges[c], edges[c + 1]):
                out[b, m, 0, k + e] = number[symbol[e]]
            for p in range(nl):
                for o in range(6):
                    out_local[b, m, 0, p] += slope[i, o] * jloc[b, s, o, p]


@kernel(inline=True)
def by_numbers(size, slope, out):
    """out (7,) <- `size` times the slopes of a length by the numbers of its cable, from a row of `slopes_of`."""
    for o in range(3):
        out[o], out[3 + o] = -size * slope[o], size * slope[6 + o]
    out[6] = -size


@kernel
def accumulate_lengths(
    t, jac, jloc, numbers, radius, axis, share, sight, walk, cable, edges, symbol, value, scale, weight, configuration, columns, local,
    loss, tuning, curved, cost, g, a, gl, al, asl,
):  # fmt: skip
    """Adds lengths of cables to the normal equations.

    t (B, S, 4, 4), jac (B, S, 6, k) and jloc (B, S, 6, l) are those of the poses; row i is of pose sight[i] and of a cable, whose
    seven numbers are numbers (B, C, 7), of which edges[c] .. edges[c + 1] of symbol (c,) are free; walk (m,) takes the rows of a pose
    together. columns (k + c,): the pose's, then those of the free numbers. The rest is as in `estimate._kernels.accumulate`, d = 1.
    """
    batch, k, nl, cables, rows = t.shape[0], jac.shape[3], jloc.shape[3], numbers.shape[1], sight.shape[0]
    length, slope, by, lrow = np.empty(rows), np.empty((rows, 9)), np.empty(6), np.empty(nl)
    wide = k + NUMBERS
    row, chosen, pairs = np.empty(wide), np.empty(wide), np.empty((wide, wide))
    feeds, some = np.empty(wide, np.int64), np.empty(wide, np.int64)
    small_g, small_a = np.empty((cables, wide)), np.empty((cables, wide, wide))
    for b in range(batch):
        wb = b if weight.shape[0] > 1 else 0
        vb = b if value.shape[0] > 1 else 0
        slopes_of(t[b], numbers[b], radius, axis, share, sight, cable, cable, length, slope)
        small_g[:], small_a[:] = 0.0, 0.0
        before, plain = -1, False
        for i in walk:
            w = weight[wb, configuration[i]]
            size = scale[i, 0]
            if w == 0.0 or size == 0.0:
                continue
            c, s = cable[i], sight[i]
            r = size * (length[i] - value[vb, i, 0])
            rho, pull = robust(loss, tuning, r * r)
            cost[b] += 0.5 * w * rho
            w *= pull
            if w == 0.0:
                continue
            wr = w * r
            if curved[b]:
                w *= kept(loss, tuning, r * r) ** 2
            for o in range(6):
                by[o] = size * slope[i, o]
            by_numbers(size, slope[i], row)
            for p in range(k):
                v = 0.0
                for o in range(6):
                    v += by[o] * jac[b, s, o, p]
                row[NUMBERS + p] = v
            # All seven numbers, free or not: a loop of a length that the compiler knows takes a fraction of the time.
            for p in range(NUMBERS):
                v = w * row[p]
                small_g[c, p] += wr * row[p]
                for o in range(NUMBERS):
                    small_a[c, p, o] += v * row[o]
            for p in range(NUMBERS, wide):
                v = w * row[p]
                small_g[c, p] += wr * row[p]
                for o in range(p + 1):
                    small_a[c, p, o] += v * row[o]
            at = local[i] if nl > 0 else -1
            if at < 0:
                continue
            if s != before:
                before, plain = s, is_identity(jloc[b, s])
            if plain:  # as every free pose: six numbers, which the compiler knows
                for p in range(6):
                    v = w * by[p]
                    gl[b, at, p] += wr * by[p]
                    for o in range(6):
                        al[b, at, p, o] += v * by[o]
                for e in range(edges[c], edges[c + 1]):
                    v, to = w * row[symbol[e]], columns[k + e]
                    for o in range(6):
                        asl[b, at, to, o] += v * by[o]
                for p in range(k):
                    v, to = w * row[NUMBERS + p], columns[p]
                    for o in range(6):
                        asl[b, at, to, o] += v * by[o]
                continue
            for p in range(nl):
                lrow[p] = 0.0
                for o in range(6):
                    lrow[p] += by[o] * jloc[b, s, o, p]
                gl[b, at, p] += wr * lrow[p]
            own = free_of(c, k, edges, symbol, columns, some, feeds)
            for p in range(own):
                chosen[p] = row[some[p]]
            add_block(at, w, lrow, chosen[:own], feeds, al[b], asl[b])
        for c in range(cables):
            own = free_of(c, k, edges, symbol, columns, some, feeds)
            for p in range(own):
                chosen[p] = small_g[c, some[p]]
                for o in range(p + 1):
                    pairs[p, o] = small_a[c, max(some[p], some[o]), min(some[p], some[o])]
            add_shared_columns(feeds[:own], chosen, pairs, g[b], a[b])


@kernel
def free_of(c, k, edges, symbol, columns, some, feeds):
    """Which of a cable's numbers and of the pose's k columns are free, some (.,), and the columns that they feed; how many."""
    own = edges[c + 1] - edges[c]
    for p in range(own):
        some[p], feeds[p] = symbol[edges[c] + p], columns[k + edges[c] + p]
    for p in range(k):
        some[own + p], feeds[own + p] = NUMBERS + p, columns[p]
    return own + k


@kernel
def is_identity(j):
    """Whether j (6, l) is the identity."""
    if j.shape[1] != 6:
        return False
    for p in range(6):
        for o in range(6):
            if j[p, o] != (1.0 if p == o else 0.0):
                return False
    return True
