"""Closed-form fits to points."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array
from robocal.errors import require
from robocal.geometry import se3, so3

__all__ = ["plane", "rigid"]


def rigid(source: ArrayLike, target: ArrayLike) -> Array:
    """The T (4, 4) that minimises sum |T a_i - b_i|^2; a, b (m, 3), m >= 3.

    Source: Kabsch (1976), Umeyama (1991). Raises ModelError for fewer than three points.
    """
    a, b = np.asarray(source, float), np.asarray(target, float)
    require(len(a) >= 3, "a rigid fit needs at least three points", found=len(a))
    ca, cb = a.mean(axis=0), b.mean(axis=0)
    r = so3.project((b - cb).T @ (a - ca))
    return se3.compose(r, cb - r @ ca)


def plane(points: ArrayLike) -> tuple[Array, float, Array]:
    """Unit normal n (3,), offset c with n . p = c, and the signed distances (m,) of the best plane through points (m,
    3)."""
    p = np.asarray(points, float)
    centre = p.mean(axis=0)
    normal = np.linalg.svd(p - centre, full_matrices=False)[2][2]
    return normal, float(normal @ centre), (p - centre) @ normal
