"""Where a function on a grid is zero, by straight pieces."""

from __future__ import annotations

import numpy as np

from robocal._types import Array

__all__ = ["contour"]


def contour(u: Array, v: Array, values: Array, *, unknown: bool = False) -> Array:
    """Segments (n, 2, 2) in coordinates (u, v) where values (len(u), len(v)) pass zero; what is not finite counts as far below,
    or with `unknown` the squares that it is a corner of have no line.

    A square whose corners alternate is cut twice, its middle deciding how.
    """
    finite = values[np.isfinite(values)]
    far = float(np.abs(finite).max()) if len(finite) else 1.0
    z = np.where(np.isfinite(values), values, np.where(values == np.inf, far, -far))
    z = np.where(z == 0.0, 1e-12 * (far or 1.0), z)
    corners = np.stack([z[:-1, :-1], z[1:, :-1], z[1:, 1:], z[:-1, 1:]])  # around the square
    places = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1)
    at = np.stack([places[:-1, :-1], places[1:, :-1], places[1:, 1:], places[:-1, 1:]])
    after, after_at = np.roll(corners, -1, axis=0), np.roll(at, -1, axis=0)
    passes = (corners > 0) != (after > 0)
    if unknown:
        known = np.isfinite(values)
        passes &= known[:-1, :-1] & known[1:, :-1] & known[1:, 1:] & known[:-1, 1:]
    share = corners / np.where(passes, corners - after, 1.0)
    hit = at + share[..., None] * (after_at - at)
    pieces = []
    for i, j in ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)):
        both = passes[i] & passes[j] & (passes.sum(axis=0) == 2)
        pieces.append(np.stack([hit[i][both], hit[j][both]], axis=1))
    saddle = passes.all(axis=0)
    joined = (corners.mean(axis=0) > 0) == (corners[0] > 0)
    for mask, pairs in ((saddle & joined, ((0, 1), (2, 3))), (saddle & ~joined, ((3, 0), (1, 2)))):
        pieces += [np.stack([hit[i][mask], hit[j][mask]], axis=1) for i, j in pairs]
    return np.concatenate(pieces)
