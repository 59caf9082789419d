"""What one sight says of where its target stands, and of how large it was printed, in compiled code."""

from __future__ import annotations

from robocal._jit import kernel


@kernel
def add_seat(f, d, h, gs, both, k, c, carried, turned, g, a, wide):
    """Adds what one sight says of its target's own columns, n of motions (6) and of its edge (7), to g (n,), a (n, n) and, beside the
    view's columns, wide (n, k + c); turned (6 + c + 1, n) <- the sight's beside them.

    The target stands at d in a view at f: its motion (v, w) in the view's axes moves points as `carried` of it does about the view's
    origin, [R  (R p) x R; 0  R], p its place. h and gs are the sight's by motions about that origin, numbers of the instrument, and
    the edge.
    """
    px = f[0, 0] * d[0, 3] + f[0, 1] * d[1, 3] + f[0, 2] * d[2, 3]
    py = f[1, 0] * d[0, 3] + f[1, 1] * d[1, 3] + f[1, 2] * d[2, 3]
    pz = f[2, 0] * d[0, 3] + f[2, 1] * d[1, 3] + f[2, 2] * d[2, 3]
    for i in range(3):
        for p in range(3):
            carried[i, p] = carried[3 + i, 3 + p] = f[i, p]
    for p in range(3):
        carried[0, 3 + p] = py * f[2, p] - pz * f[1, p]
        carried[1, 3 + p] = pz * f[0, p] - px * f[2, p]
        carried[2, 3 + p] = px * f[1, p] - py * f[0, p]
    for i in range(6):
        for j in range(i):
            h[j, i] = h[i, j]
    n = g.shape[0]
    for i in range(c + n):
        b0, b1, b2, b3, b4, b5 = h[i, 0], h[i, 1], h[i, 2], h[i, 3], h[i, 4], h[i, 5]
        for o in range(6):
            turned[i, o] = (
                b0 * carried[0, o]
                + b1 * carried[1, o]
                + b2 * carried[2, o]
                + b3 * carried[3, o]
                + b4 * carried[4, o]
                + b5 * carried[5, o]
            )
    if n > 6:
        for i in range(6 + c):
            turned[i, 6] = h[6 + c, i]
        g[6] += gs[6 + c]
        a[6, 6] += h[6 + c, 6 + c]
        for o in range(6):
            a[6, o] += turned[6 + c, o]
    for j in range(6):
        for o in range(6):
            g[o] += carried[j, o] * gs[j]
    for o in range(n):
        b0, b1, b2, b3, b4, b5 = turned[0, o], turned[1, o], turned[2, o], turned[3, o], turned[4, o], turned[5, o]
        row = wide[o]
        for p in range(k):
            row[p] += (
                b0 * both[0, p]
                + b1 * both[1, p]
                + b2 * both[2, p]
                + b3 * both[3, p]
                + b4 * both[4, p]
                + b5 * both[5, p]
            )
        for p in range(c):
            row[k + p] += turned[6 + p, o]
        if o == 6:
            continue
        b0, b1, b2, b3, b4, b5 = (
            carried[0, o],
            carried[1, o],
            carried[2, o],
            carried[3, o],
            carried[4, o],
            carried[5, o],
        )
        for p in range(6):
            a[o, p] += (
                b0 * turned[0, p]
                + b1 * turned[1, p]
                + b2 * turned[2, p]
                + b3 * turned[3, p]
                + b4 * turned[4, p]
                + b5 * turned[5, p]
            )


@kernel
def add_seat_columns(free, columns, own_g, own_a, wide, g, a):
    """Adds a target's own columns, free (n,) or -1, and what they share with other columns, to g and the lower triangle a."""
    for o in range(free.shape[0]):
        i = free[o]
        if i < 0:
            continue
        g[i] += own_g[o]
        for p in range(o + 1):
            j = free[p]
            if j >= 0:
                a[max(i, j), min(i, j)] += own_a[o, p]
        for p in range(columns.shape[0]):
            j = columns[p]
            a[max(i, j), min(i, j)] += 2.0 * wide[o, p] if i == j else wide[o, p]
