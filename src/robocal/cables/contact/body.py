"""The platform's body: a convex set of half-spaces, from a box or from points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull

from robocal._types import Array
from robocal.errors import ModelError

__all__ = ["Body", "box", "hull"]


@dataclass(frozen=True)
class Body:
    """All x in platform coordinates with n_f . x <= h_f for every face f: normals (f, 3) of unit length, offsets (f,) in m."""

    normals: Array
    offsets: Array

    def height(self, points: ArrayLike) -> Array:
        """max_f (n_f . x - h_f) in m for points (..., 3): at most 0 inside, and never more than the distance outside."""
        return np.asarray((np.asarray(points, float) @ self.normals.T - self.offsets).max(axis=-1))


def box(half_sizes: ArrayLike, centre: ArrayLike = (0.0, 0.0, 0.0)) -> Body:
    """The box of the given half sizes (3,) in m about `centre`, its edges along the platform's axes.

    Raises ModelError for half sizes that are not three numbers of at least 0.
    """
    half, c = np.asarray(half_sizes, float), np.asarray(centre, float)
    if half.shape != (3,) or not (np.isfinite(half).all() and (half >= 0).all()):
        raise ModelError(
            "half sizes of the platform's box", expected="three lengths in m, at least 0", found=half_sizes
        )
    if c.shape != (3,) or not np.isfinite(c).all():
        raise ModelError("centre of the platform's box", expected="three coordinates in m", found=centre)
    normals = np.vstack([np.eye(3), -np.eye(3)])
    return Body(normals, normals @ c + np.tile(half, 2))


def hull(points: ArrayLike) -> Body:
    """The convex hull of points (k, 3) in platform coordinates; points in a plane, on a line or in one place give a flat one.

    Raises ModelError for anything but finite points.
    """
    p = np.asarray(points, float)
    if p.ndim != 2 or p.shape[1:] != (3,) or len(p) == 0 or not np.isfinite(p).all():
        raise ModelError("points of the platform's body", expected="finite numbers of shape (k, 3)", found=p.shape)
    centre = p.mean(axis=0)
    _, sizes, axes = np.linalg.svd(p - centre)
    rank = int((sizes > 1e-9 * max(1.0, sizes[0])).sum())
    local = (p - centre) @ axes[:rank].T
    if rank >= 2:
        # The same face comes once per triangle.
        faces = np.unique(np.round(ConvexHull(local).equations, 12), axis=0)
        inner, offsets = faces[:, :-1], -faces[:, -1]
        # Rounding of the equations must not leave a point outside.
        offsets = np.maximum(offsets, (local @ inner.T).max(axis=0))
    elif rank == 1:
        inner, offsets = np.array([[1.0], [-1.0]]), np.array([local.max(), -local.min()])
    else:
        inner, offsets = np.zeros((0, 0)), np.zeros(0)
    flat = np.vstack([axes[rank:], -axes[rank:]])
    # A flat body keeps no room of its own across itself, but for the rounding of its points.
    thickness = ((p - centre) @ flat.T).max(axis=0) if len(flat) else np.zeros(0)
    normals = np.vstack([inner @ axes[:rank], flat])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Body(normals, normals @ centre + np.concatenate([offsets, thickness]))
