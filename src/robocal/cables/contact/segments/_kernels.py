"""Two segments in space: their distance and the normal between them; callers own every buffer."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel


@kernel
def dot(a, b):
    """a . b of vectors (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def cross_norm(a, b):
    """|a x b| of vectors (3,)."""
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    z = a[0] * b[1] - a[1] * b[0]
    return math.sqrt(x * x + y * y + z * z)


@kernel
def clamp(x):
    """x, or the end of [0, 1] nearest to it."""
    return min(max(x, 0.0), 1.0)


@kernel
def separation(p, p_end, q, q_end, n, share):
    """n (3,) <- the unit vector of the shortest way from segment q to segment p; returns its length (0 leaves n 0).

    share (2 or more,) <- where that way ends on p and on q, 0 to 1. The inner stationary point and the four ends are all
    tried, so that segments that are parallel, or points, need no case of their own.
    """
    aa = bb = ab = ar = br = 0.0
    for i in range(3):
        d, e, r = p_end[i] - p[i], q_end[i] - q[i], p[i] - q[i]
        aa += d * d
        bb += e * e
        ab += d * e
        ar += d * r
        br += e * r
    best = np.inf
    best_s = best_t = 0.0
    det = aa * bb - ab * ab
    for k in range(5):
        if k == 0:
            if det <= 0.0:
                continue
            s = (ab * br - bb * ar) / det
            t = (br + s * ab) / bb  # from s: the two agree across the lines even where they are almost parallel
            if s <= 0.0 or s >= 1.0 or t <= 0.0 or t >= 1.0:
                continue
        elif k <= 2:
            s = k - 1.0
            t = clamp((br + s * ab) / bb) if bb > 0.0 else 0.0
        else:
            t = k - 3.0
            s = clamp((t * ab - ar) / aa) if aa > 0.0 else 0.0
        x = p[0] + s * (p_end[0] - p[0]) - q[0] - t * (q_end[0] - q[0])
        y = p[1] + s * (p_end[1] - p[1]) - q[1] - t * (q_end[1] - q[1])
        z = p[2] + s * (p_end[2] - p[2]) - q[2] - t * (q_end[2] - q[2])
        d2 = x * x + y * y + z * z
        if d2 < best:
            best, best_s, best_t = d2, s, t
            n[0], n[1], n[2] = x, y, z
    share[0], share[1] = best_s, best_t
    length = math.sqrt(best)
    if length > 0.0:
        for i in range(3):
            n[i] /= length
        square(p, p_end, q, q_end, 0.0 < best_s < 1.0, 0.0 < best_t < 1.0, n)
    return length


@kernel
def square(p, p_end, q, q_end, inside_p, inside_q, n):
    """Sets n at right angles to what it meets inside, which a difference of nearly equal points is not."""
    if inside_p and inside_q:
        ax, ay, az = p_end[0] - p[0], p_end[1] - p[1], p_end[2] - p[2]
        bx, by, bz = q_end[0] - q[0], q_end[1] - q[1], q_end[2] - q[2]
        x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        size = math.sqrt(x * x + y * y + z * z)
        if size > 1e-8 * math.sqrt((ax * ax + ay * ay + az * az) * (bx * bx + by * by + bz * bz)):
            if x * n[0] + y * n[1] + z * n[2] < 0.0:
                size = -size
            n[0], n[1], n[2] = x / size, y / size, z / size
    elif inside_p or inside_q:
        x, y, z = q_end[0] - q[0], q_end[1] - q[1], q_end[2] - q[2]
        if inside_p:
            x, y, z = p_end[0] - p[0], p_end[1] - p[1], p_end[2] - p[2]
        lean = (x * n[0] + y * n[1] + z * n[2]) / (x * x + y * y + z * z)
        x, y, z = n[0] - lean * x, n[1] - lean * y, n[2] - lean * z
        size = math.sqrt(x * x + y * y + z * z)
        if size > 0.5:
            n[0], n[1], n[2] = x / size, y / size, z / size


@kernel
def separations(p, p_end, q, q_end, out):
    """out (k,) <- distances between k pairs of segments (k, 3)."""
    n, share = np.empty(3), np.empty(2)
    for i in range(out.shape[0]):
        out[i] = separation(p[i], p_end[i], q[i], q_end[i], n, share)
