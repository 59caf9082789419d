"""Rigid motions: 4x4 matrices, six-vectors and the exponential of twists, batched over leading axes.

A *frame vector* is (x, y, z, rx, ry, rz): translation and rotation vector, what parameter tables store. A *twist* is
(v, w).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array
from robocal.geometry import so3

__all__ = ["compose", "displace", "displacement", "from_vector", "inverse", "to_vector"]


def compose(rotation: ArrayLike, translation: ArrayLike) -> Array:
    """T from R (..., 3, 3) and p (..., 3); shape (..., 4, 4)."""
    r, p = np.asarray(rotation, float), np.asarray(translation, float)
    out = np.zeros((*np.broadcast_shapes(r.shape[:-2], p.shape[:-1]), 4, 4))
    out[..., :3, :3], out[..., :3, 3], out[..., 3, 3] = r, p, 1.0
    return out


def from_vector(vector: ArrayLike) -> Array:
    """T of a frame vector (..., 6): translation and rotation vector kept apart, no coupling."""
    v = np.asarray(vector, float)
    if v.ndim != 2:
        return compose(so3.exp(v[..., 3:]), v[..., :3])
    out = np.zeros((len(v), 4, 4))  # many rotations would be there twice
    for first in range(0, len(v), so3.CHUNK):
        some = slice(first, first + so3.CHUNK)
        out[some] = compose(so3.exp(v[some, 3:]), v[some, :3])
    return out


def to_vector(transform: ArrayLike) -> Array:
    """The frame vector (..., 6) of T (..., 4, 4)."""
    t = np.asarray(transform, float)
    return np.concatenate([t[..., :3, 3], so3.log(t[..., :3, :3])], axis=-1)


def inverse(transform: ArrayLike) -> Array:
    """T^-1 = [R^T, -R^T p]."""
    t = np.asarray(transform, float)
    rt = np.swapaxes(t[..., :3, :3], -1, -2)
    return compose(rt, -(rt @ t[..., :3, 3:])[..., 0])


def displace(transform: ArrayLike, translation: ArrayLike, rotation: ArrayLike) -> Array:
    """T (..., 4, 4) after p <- p + v, R <- exp(w) R: v (..., 3) and w (..., 3), in base axes."""
    t = np.asarray(transform, float)
    return compose(so3.exp(rotation) @ t[..., :3, :3], t[..., :3, 3] + np.asarray(translation, float))


def displacement(start: ArrayLike, end: ArrayLike) -> tuple[Array, Array]:
    """v (..., 3) and w (..., 3) by which `displace` leads from one T to the other."""
    a, b = np.asarray(start, float), np.asarray(end, float)
    turn = b[..., :3, :3] @ np.swapaxes(a[..., :3, :3], -1, -2)
    return b[..., :3, 3] - a[..., :3, 3], so3.log(turn)
