"""Pixels of points that move together, in compiled code; (v, w) rows of a Jacobian are those of a frame in the camera's axes."""

from __future__ import annotations

import numpy as np

from robocal._jit import kernel
from robocal.estimate._kernels import LANES, add_shared_columns, products
from robocal.measure.sights.blocks._kernels import CORNERS, mix_points, whiten_blocks
from robocal.measure.sights.points._kernels import (
    BY_U,
    BY_V,
    LX,
    SIZE,
    TILE,
    UX,
    UY,
    UZ,
    VX,
    VY,
    VZ,
    WIDE,
    U,
    V,
    X,
    Y,
    Z,
    answer_points,
    bend_points,
    grow_points,
    move_points,
    place_points,
    project_points,
)
from robocal.measure.sights.seats._kernels import add_seat, add_seat_columns


@kernel
def congruence(h, c, both, half, out, g, gout):
    """Adds [G 0; 0 1]^T h [G 0; 0 1] to out and [G 0; 0 1]^T g to gout: from six motions of a frame and c numbers of an instrument to what
    moves the frame, G = both (6, q); h (6 + c, 6 + c) and out (q + c, q + c) lower triangles, with some of the upper one; half (6, q)
    is work space."""
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
        for k in range(min(q, p // 8 * 8 + 8)):  # beyond the diagonal, to the end of what is added at once
            row[k] += a0 * n0[k] + a1 * n1[k] + a2 * n2[k] + a3 * n3[k] + a4 * n4[k] + a5 * n5[k]
        gout[p] += a0 * g[0] + a1 * g[1] + a2 * g[2] + a3 * g[3] + a4 * g[4] + a5 * g[5]
    for p in range(c):
        a0, a1, a2, a3, a4, a5 = h[6 + p, 0], h[6 + p, 1], h[6 + p, 2], h[6 + p, 3], h[6 + p, 4], h[6 + p, 5]
        row = out[q + p]
        for k in range(q):
            row[k] += a0 * m0[k] + a1 * m1[k] + a2 * m2[k] + a3 * m3[k] + a4 * m4[k] + a5 * m5[k]
        for k in range(p + 1):
            row[q + k] += h[6 + p, 6 + k]
        gout[q + p] += g[6 + p]


@kernel
def evaluate_sights(t, jac, jloc, sight, first, point, growth, edge, intrinsics, own, r, out, local):
    """r (B, m, 2) <- the pixels at which points are seen, out (B, m, 2, k + c) and local (B, m, 2, l) <- their Jacobians by what moves
    the frames, t (B, S, 4, 4), jac (B, S, 6, k), jloc (B, S, 6, l), and by c numbers of the instrument; row i is point first + i, and
    sight (m,) its frame. Points are edge (B,) times growth from where they are stated; one more column of `out` is by that."""
    k, nl, c, m = jac.shape[3], jloc.shape[3], own.shape[0], r.shape[1]
    grown = out.shape[3] > k + c
    w, heap, numbers = np.ones(SIZE), np.empty(6 * WIDE), np.empty((c, WIDE))
    for b in range(r.shape[0]):
        for lo in range(0, m, TILE):
            n = min(TILE, m - lo)
            for i in range(n):
                f, at, by = t[b, sight[lo + i]], point[first + lo + i], growth[first + lo + i]
                x, y, z = at[0] + edge[b] * by[0], at[1] + edge[b] * by[1], at[2] + edge[b] * by[2]
                for e in range(3):
                    w[LX + e * TILE + i] = f[e, 0] * x + f[e, 1] * y + f[e, 2] * z
                    w[X + e * TILE + i] = w[LX + e * TILE + i] + f[e, 3]
            project_points(w, n, intrinsics[b])
            for i in range(n):
                r[b, lo + i, 0], r[b, lo + i, 1] = w[U + i], w[V + i]
            answer_points(own, w, n, intrinsics[b], numbers)
            for p in range(c):
                for i in range(n):
                    out[b, lo + i, 0, k + p], out[b, lo + i, 1, k + p] = numbers[p, i], numbers[p, n + i]
            for i in range(n if grown else 0):
                f, by = t[b, sight[lo + i]], growth[first + lo + i]
                gx = f[0, 0] * by[0] + f[0, 1] * by[1] + f[0, 2] * by[2]
                gy = f[1, 0] * by[0] + f[1, 1] * by[1] + f[1, 2] * by[2]
                gz = f[2, 0] * by[0] + f[2, 1] * by[1] + f[2, 2] * by[2]
                out[b, lo + i, 0, k + c] = w[UX + i] * gx + w[UY + i] * gy + w[UZ + i] * gz
                out[b, lo + i, 1, k + c] = w[VX + i] * gx + w[VY + i] * gy + w[VZ + i] * gz
            for e in range(2 if k + nl > 0 else 0):
                move_points(w, n, BY_U, VX if e else UX, heap, 0)
                for i in range(n):
                    a0, a1, a2 = heap[i], heap[WIDE + i], heap[2 * WIDE + i]
                    a3, a4, a5 = heap[3 * WIDE + i], heap[4 * WIDE + i], heap[5 * WIDE + i]
                    row, j = out[b, lo + i, e], jac[b, sight[lo + i]]
                    for p in range(k):
                        row[p] = a0 * j[0, p] + a1 * j[1, p] + a2 * j[2, p] + a3 * j[3, p] + a4 * j[4, p] + a5 * j[5, p]
                    row, j = local[b, lo + i, e], jloc[b, sight[lo + i]]
                    for p in range(nl):
                        row[p] = a0 * j[0, p] + a1 * j[1, p] + a2 * j[2, p] + a3 * j[3, p] + a4 * j[4, p] + a5 * j[5, p]


@kernel
def accumulate_views(
    t, jac, jloc, first, cut, views, edges, seat, seats, edge, free, intrinsics, own, point, growth, value, scale, block, mixing, weight,
    configuration, columns, one, two, pair, loss, tuning, curved, cost, g, a, gl, al, asl, gm, am, asm, cross,
):  # fmt: skip
    """Adds pixels to the normal equations, view by view: rows edges[i] to edges[i + 1] are a sight, points of one target; sights
    views[v] to views[v + 1] are those of view v, whose targets stand still against one another.

    t (B, m, 4, 4), jac (B, m, 6, k) and jloc (B, m, 6, l + q) are those of the views first .. first + m; the first `cut` columns
    of jloc are a block's of the first family. seats (B, T, 4, 4) say where targets are in a view, free (T, 6) the tangent columns of
    their motions or -1, seat (S,) which target a sight shows; points are edge (B, T) times growth from where they are stated, and a
    seventh of free is the column of that. intrinsics (B, n), own (c,) those that are free, columns (k + c,);
    block and mixing as in `sights.blocks`, of rows that are correlated, else empty;
    one, two and pair (V,) the blocks and the pair of every view. The rest is as in `estimate._kernels.accumulate`.
    """
    batch, m = t.shape[0], t.shape[1]
    k, nl, c = jac.shape[3], jloc.shape[3], own.shape[0]
    shared, q, size, mine = k + c, k + nl, c + free.shape[1], free.shape[1]
    lanes = (size + LANES) // LANES * LANES  # the motions, the numbers of the camera, and the residuals behind them
    w, rows, flat = np.ones(SIZE), np.empty(TILE, np.int64), np.zeros(lanes * WIDE)
    heap, h, gs, there = flat.reshape(lanes, WIDE), np.empty((lanes, lanes)), np.empty(size), np.empty((3, 4))
    numbers = heap[6:]
    whole, gv = np.empty((lanes, lanes)), np.empty(size)
    both, half = np.empty((6, q)), np.empty((6, q))
    out, gout = np.empty((q + c, q + c)), np.empty(q + c)
    small_a, small_g = np.zeros((shared, shared)), np.zeros(shared)
    loose = np.zeros(free.shape[0], np.bool_)
    for s in range(free.shape[0]):
        for p in range(mine):
            loose[s] |= free[s, p] >= 0
    own_g, own_a, wide = (
        np.zeros((free.shape[0], mine)),
        np.zeros((free.shape[0], mine, mine)),
        np.zeros((free.shape[0], mine, shared)),
    )
    carried, turned = np.zeros((6, 6)), np.empty((size, mine))
    mixed, roots = mixing.shape[0] > 0, np.empty(TILE)
    for b in range(batch):
        wb = b if weight.shape[0] > 1 else 0
        lens, of = intrinsics[b], (value[b if value.shape[0] > 1 else 0], scale, block, mixing)
        small_a[:] = 0.0
        small_g[:] = 0.0
        out[:] = 0.0
        gout[:] = 0.0
        own_g[:] = 0.0
        own_a[:] = 0.0
        wide[:] = 0.0
        for v in range(m):
            heavy = weight[wb, configuration[edges[views[first + v]]]]  # a view is one of one configuration
            if heavy == 0.0:
                continue
            whole[:] = 0.0
            gv[:] = 0.0
            f = t[b, v]
            seen = 0
            for i in range(6):
                for p in range(k):
                    both[i, p] = jac[b, v, i, p]
                for p in range(nl):
                    both[i, k + p] = jloc[b, v, i, p]
            for s in range(views[first + v], views[first + v + 1]):
                # What only the view hears of goes to its sum at once.
                hs, pull = (h, gs) if loose[seat[s]] else (whole, gv)
                if loose[seat[s]]:
                    h[:] = 0.0
                    gs[:] = 0.0
                d = seats[b, seat[s]]
                for i in range(3):
                    for p in range(4):
                        there[i, p] = f[i, 0] * d[0, p] + f[i, 1] * d[1, p] + f[i, 2] * d[2, p]
                after, some = edges[s], 0
                while after < edges[s + 1]:
                    n = 0
                    while after < edges[s + 1] and n < TILE:
                        if mixed and n > TILE - CORNERS and block[after] != block[rows[n - 1]]:
                            break
                        if scale[after, 0] != 0.0 or scale[after, 1] != 0.0:
                            rows[n] = after
                            n += 1
                        after += 1
                    place_points(rows, n, point, growth, edge[b, seat[s]], there, f, w)
                    # Several are projected at once: what stands behind the last is no point of this sight, but finite.
                    full = (n + LANES - 1) // LANES * LANES if n else 0
                    for i in range(n, full):
                        w[X + i], w[Y + i], w[Z + i] = w[X + n - 1], w[Y + n - 1], w[Z + n - 1]
                    project_points(w, full, lens)
                    cost[b] += 0.5 * heavy * whiten_blocks(rows, n, *of, heavy, loss, tuning, curved[b], w, roots)
                    if q + c == 0 and not loose[seat[s]]:
                        continue
                    move_points(w, n, BY_U, UX, flat, 0)
                    move_points(w, n, BY_V, VX, flat, n)
                    if c > 0:
                        answer_points(own, w, n, lens, numbers)
                    if mine > 6:
                        grow_points(rows, n, growth, there, w, heap[6 + c])
                    if mixed:
                        mix_points(rows, n, scale, block, mixing, roots, size, heap)
                    for i in range(n):
                        heap[size, i], heap[size, n + i] = w[U + i], w[V + i]
                    if curved[b]:
                        bend_points(w, n, heap, pull)
                    products(heap, 2 * n, hs)
                    some += n
                if some == 0:
                    continue
                seen += some
                if loose[seat[s]]:
                    for i in range(size):
                        gs[i] += h[size, i]
                        gv[i] += gs[i]
                        for p in range(i + 1):
                            whole[i, p] += h[i, p]
                    add_seat(f, d, h, gs, both, k, c, carried, turned, own_g[seat[s]], own_a[seat[s]], wide[seat[s]])
                    for j in range(nl):
                        # A target's motions beside those of a block: where the pose of the view is free.
                        for o in range(mine):
                            if free[seat[s], o] >= 0:
                                total = 0.0
                                for i in range(6):
                                    total += jloc[b, v, i, j] * turned[i, o]
                                if j < cut:
                                    asl[b, one[first + v], free[seat[s], o], j] += total
                                else:
                                    asm[b, two[first + v], free[seat[s], o], j - cut] += total
            if not seen or q + c == 0:
                continue
            if nl > 0:
                out[:] = 0.0
                gout[:] = 0.0
            for i in range(size):
                gv[i] += whole[size, i]
            congruence(whole, c, both, half, out, gv, gout)
            if nl == 0:
                continue
            add_shared(k, nl, c, out, gout, small_a, small_g)
            if cut > 0:
                add_sight_block(one[first + v], k, cut, c, out, gout, columns, gl[b], al[b], asl[b])
            if nl > cut:
                add_sight_block(two[first + v], k + cut, nl - cut, c, out, gout, columns, gm[b], am[b], asm[b])
                if cut > 0:
                    here = cross[b, pair[first + v]]
                    for p in range(cut):
                        for o in range(nl - cut):
                            here[p, o] += out[k + cut + o, k + p]
        if nl == 0:  # nothing was told to blocks view by view
            add_shared(k, nl, c, out, gout, small_a, small_g)
        add_shared_columns(columns, small_g, small_a, g[b], a[b])
        for s in range(free.shape[0]):
            if loose[s]:
                add_seat_columns(free[s], columns, own_g[s], own_a[s], wide[s], g[b], a[b])


@kernel
def add_shared(k, nl, c, out, gout, small_a, small_g):
    """Adds the columns of a frame, k of `out`, and of an instrument, c behind nl of local blocks, to those that are shared."""
    for p in range(k + c):
        at = p if p < k else p + nl
        small_g[p] += gout[at]
        for o in range(min(p + 1, k)):
            small_a[p, o] += out[at, o]
        for o in range(k, p + 1):
            small_a[p, o] += out[at, nl + o]


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
