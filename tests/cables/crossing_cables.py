"""Cables that cross while the platform shifts without turning: the closed form.

Cables k and l, without thickness, run from a_k to B_k + lambda v and from a_l to B_l + lambda v. With e = a_l - a_k,
c_k = B_k - a_k, c_l = B_l - a_l and g = B_k - B_l, they lie in one plane when e . (c_k + lambda v) x (c_l + lambda v) = 0.
v x v = 0 and c_k - c_l = g + e leave a *linear* equation,

    e . (c_k x c_l) + lambda e . (g x v) = 0

so a pair meets its plane at most once. Where both terms vanish the two stay in one plane; they then begin to touch where an
end of one lies on the other, and each of the four such events is linear in lambda too.
Source: Perreault, Cardou, Gosselin, Otis, Journal of Mechanisms and Robotics 2 (2010) 031016, who give the planes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array, Ints
from robocal.cables.interference import distances


def crossings(a: ArrayLike, ends: ArrayLike, translation: ArrayLike, tolerance: float = 1e-9) -> tuple[Array, Ints]:
    """lambda (B, n) at which each pair of cables without thickness first crosses, inf where it does not on [0, 1].

    a (m, 3) frame anchors and ends (m, 3) or (B, m, 3) platform anchors at the start, in base axes, m; translation (B, 3) m.
    The n = m (m - 1) / 2 pairs (k, l) are the rows of the second array returned, (n, 2). `tolerance` in m decides whether two
    cables touch where their lines do. A pair with a common end is left at inf: it has one point in common all the time.
    """
    frame, v = np.asarray(a, float), np.atleast_2d(np.asarray(translation, float))
    start = np.broadcast_to(np.asarray(ends, float), (len(v), *frame.shape))
    pairs = np.stack(np.triu_indices(len(frame), 1), axis=1)
    ak, al = (np.broadcast_to(frame[i], (len(v), len(pairs), 3)) for i in pairs.T)
    bk, bl = start[:, pairs[:, 0]], start[:, pairs[:, 1]]
    step = np.broadcast_to(v[:, None], bk.shape)
    at = np.stack([*_events(ak, bk, al, bl, step)])
    at = np.where((at >= 0) & (at <= 1), at, np.inf)
    when = np.where(np.isfinite(at), at, 0.0)[..., None]
    apart = distances(*(x.reshape(-1, 3) for x in np.broadcast_arrays(ak, bk + when * step, al, bl + when * step)))
    at[apart.reshape(at.shape) > tolerance] = np.inf
    first = at.min(axis=0)
    common = (np.linalg.norm(ak - al, axis=-1) <= tolerance) | (np.linalg.norm(bk - bl, axis=-1) <= tolerance)
    return np.where(common, np.inf, first), pairs


def _events(ak: Array, bk: Array, al: Array, bl: Array, v: Array) -> list[Array]:
    """Every lambda at which two cables can begin to touch: the start, their common plane, an end of one on the other's line."""
    ck, cl, e, g = bk - ak, bl - al, al - ak, bk - bl
    # A normal of the plane that they share, for the events in it: the largest of the products that span it.
    products = np.stack([np.cross(ck, v), np.cross(cl, v), np.cross(ck, cl), np.cross(e, v), np.cross(e, ck)])
    best = np.linalg.norm(products, axis=-1).argmax(axis=0)
    normal = np.take_along_axis(products, best[None, ..., None], axis=0)[0]

    def root(constant: Array, slope: Array) -> Array:
        with np.errstate(divide="ignore", invalid="ignore"):
            found = -(constant * normal).sum(axis=-1) / (slope * normal).sum(axis=-1)
        return np.where(np.isfinite(found), found, np.inf)

    with np.errstate(divide="ignore", invalid="ignore"):
        plane = -(e * np.cross(ck, cl)).sum(axis=-1) / (e * np.cross(g, v)).sum(axis=-1)
    return [
        np.zeros(plane.shape),
        np.where(np.isfinite(plane), plane, np.inf),
        root(np.cross(-e, cl), np.cross(-e, v)),  # a_k on the line of l
        root(np.cross(e, ck), np.cross(e, v)),  # a_l on the line of k
        root(np.cross(bk - al, cl), np.cross(g, v)),  # B_k on the line of l: (B_k - a_l + lambda v) x (c_l + lambda v)
        root(np.cross(bl - ak, ck), np.cross(-g, v)),
    ]
