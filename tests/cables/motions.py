"""A dense sampling of motions, written without the package: what first contacts are held to."""

from __future__ import annotations

import numpy as np
from cables.cable_robots import published


def anchors(name):
    """Frame and platform anchors, (m, 3) each, of a published robot."""
    robot = published(name)
    return robot.a, robot.b


def pose(position, rotation=None):
    out = np.eye(4)
    out[:3, 3] = position
    if rotation is not None:
        out[:3, :3] = rotation
    return out


def turns(w, lam):
    """exp(lam w), (n, 3, 3), by Rodrigues."""
    angle = np.linalg.norm(w)
    x, y, z = w / angle if angle else np.zeros(3)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    t = (lam * angle)[:, None, None]
    return np.eye(3) + np.sin(t) * k + (1 - np.cos(t)) * (k @ k)


def random_motions(a, rng, n, turn=np.pi / 3):
    """A start somewhere about the middle, a translation as large as the machine, a rotation."""
    size = np.ptp(a, axis=0)
    start = np.stack([pose(a.mean(0) + rng.uniform(-0.1, 0.1, 3) * size) for _ in range(n)])
    for s in start:
        s[:3, :3] = turns(rng.normal(0, 0.1, 3), np.ones(1))[0]
    return start, rng.uniform(-0.5, 0.5, (n, 3)) * size, rng.uniform(-1, 1, (n, 3)) * turn


def _dot(p, q):
    """Components stand first, (3, ...): a sum over a last axis of three takes numpy five times as long."""
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


def _cross(p, q):
    return p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]


def _to_segment(p, q, d, dd=None):
    """Squared distance from points to segments q + t d, all (3, ...)."""
    dd = _dot(d, d) if dd is None else dd
    r = p - q
    t = np.clip(_dot(r, d) / np.maximum(dd, 1e-300), 0, 1)
    r = r - t * d
    return _dot(r, r)


def sampled(a, b, start, v, w, steps):
    """The poses of a motion at lam = 0 .. 1: lam (n,), R (n, 3, 3), p (n, 3), platform anchors (n, m, 3)."""
    lam = np.linspace(0, 1, steps + 1)
    r = turns(w, lam) @ start[:3, :3]
    p = start[:3, 3] + lam[:, None] * v
    return lam, r, p, p[:, None] + np.einsum("nij,mj->nmi", r, b)


def in_pieces(function, *along, rows=250):
    """What a function of poses gives, piece by piece of arrays whose first axis is the poses: what fits the processor's cache takes half the time."""
    pieces = [function(*(x[i : i + rows] for x in along)) for i in range(0, len(along[0]), rows)]
    return [np.concatenate(part) for part in zip(*pieces, strict=True)]


def pair_distances(a, ends, pairs):
    """Distances (n, pairs) between cables, and whether the lines' nearest points lie well inside both, and their side."""
    return in_pieces(lambda some: _pair_distances(a, some, pairs), ends)


def _pair_distances(a, ends, pairs):
    first, last = a.T[:, None], np.ascontiguousarray(np.moveaxis(ends, -1, 0))  # (3, 1, m), (3, n, m)
    way = last - first
    k, l = pairs.T
    one, other = first[:, :, k], first[:, :, l]
    d, e, r = way[:, :, k], way[:, :, l], one - other
    n = _cross(d, e)
    nn, side, dd, ee = _dot(n, n), _dot(n, r), _dot(d, d), _dot(e, e)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = -_dot(_cross(r, e), n) / nn
        t = -_dot(_cross(r, d), n) / nn
        inside = (s > 1e-3) & (s < 1 - 1e-3) & (t > 1e-3) & (t < 1 - 1e-3)
        across = np.where((s >= 0) & (s <= 1) & (t >= 0) & (t <= 1), side**2 / nn, np.inf)
    at_ends = [
        _to_segment(one, other, e, ee),
        _to_segment(last[:, :, k], other, e, ee),
        _to_segment(other, one, d, dd),
        _to_segment(last[:, :, l], one, d, dd),
    ]
    return np.sqrt(np.minimum(across, np.minimum.reduce(at_ends))), inside, side


def beyond(cut, far):
    """The distance (n,) of two pieces, from `cut` to `far` (n, 2, 3), that do not cross: one of four ends is nearest."""
    cut, far = np.moveaxis(cut, -1, 0), np.moveaxis(far, -1, 0)
    way = far - cut
    found = [_to_segment(e[..., i], cut[..., 1 - i], way[..., 1 - i]) for i in range(2) for e in (cut, far)]
    return np.sqrt(np.min(found, axis=0))


def body_overlap(a, b, r, p, normals, offsets, relief, radius):
    """Whether a cable beyond `relief` from its anchor, or its far end, meets the half-spaces moved out by its radius, (n, m), by clipping."""
    away = np.einsum("nji,nmj->nmi", r, a - p[:, None]) - b
    length = np.linalg.norm(away, axis=-1)
    u = away / length[..., None]
    low, high = np.minimum(relief, length), length.copy()
    for normal, h in zip(normals, offsets + radius, strict=True):
        slope, room = u @ normal, h - b @ normal
        with np.errstate(divide="ignore", invalid="ignore"):
            at = room / slope
        high = np.where(slope > 0, np.minimum(high, at), high)
        low = np.where(slope < 0, np.maximum(low, at), low)
        high = np.where((slope == 0) & (room < 0), -np.inf, high)
    return low <= high
