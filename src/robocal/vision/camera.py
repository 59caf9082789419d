"""The camera: pinhole with radial and tangential distortion (Brown 1966; the coefficients are OpenCV's k1 k2 p1 p2 k3).

x = X / Z, y = Y / Z, r2 = x^2 + y^2, d = 1 + k1 r2 + k2 r2^2 + k3 r2^3
u = fx (x d + 2 p1 x y + p2 (r2 + 2 x^2)) + cx,  v = fy (y d + p1 (r2 + 2 y^2) + 2 p2 x y) + cy
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array

__all__ = ["SYMBOLS", "image_of", "project"]

SYMBOLS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")


def image_of(points: Array, intrinsics: Array) -> Array:
    """Pixels (..., 2) of points (..., 3), as `project` has them, without Jacobians."""
    fx, fy, cx, cy, k1, k2, p1, p2, k3 = np.moveaxis(intrinsics, -1, 0)
    iz = 1 / points[..., 2]
    x, y = points[..., 0] * iz, points[..., 1] * iz
    r2 = x * x + y * y
    d = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    xd = x * d + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    yd = y * d + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.stack([fx * xd + cx, fy * yd + cy], axis=-1)


def project(points: Array, intrinsics: Array) -> tuple[Array, Array, Array]:
    """Pixels (..., 2) of points (..., 3) in camera coordinates (Z forward, m), with the Jacobians (..., 2, 3) and
    (..., 2, 9).

    intrinsics (..., 9) in the order of SYMBOLS, broadcast against the points.
    """
    fx, fy, cx, cy, k1, k2, p1, p2, k3 = np.moveaxis(intrinsics, -1, 0)
    iz = 1 / points[..., 2]
    x, y = points[..., 0] * iz, points[..., 1] * iz
    r2 = x * x + y * y
    d = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    dd = k1 + r2 * (2 * k2 + 3 * r2 * k3)  # derivative of d with respect to r2
    xd = x * d + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    yd = y * d + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    xx = d + 2 * x * x * dd + 2 * p1 * y + 6 * p2 * x
    xy = 2 * x * y * dd + 2 * p1 * x + 2 * p2 * y
    yy = d + 2 * y * y * dd + 6 * p1 * y + 2 * p2 * x
    jp = np.empty((*x.shape, 2, 3))
    jp[..., 0, 0], jp[..., 0, 1] = fx * xx * iz, fx * xy * iz
    jp[..., 1, 0], jp[..., 1, 1] = fy * xy * iz, fy * yy * iz
    jp[..., 0, 2] = -fx * iz * (xx * x + xy * y)
    jp[..., 1, 2] = -fy * iz * (xy * x + yy * y)
    ji = np.zeros((*x.shape, 2, 9))
    ji[..., 0, 0], ji[..., 1, 1] = xd, yd
    ji[..., 0, 2] = ji[..., 1, 3] = 1.0
    for i, power in ((4, 1), (5, 2), (8, 3)):
        ji[..., 0, i], ji[..., 1, i] = fx * x * r2**power, fy * y * r2**power
    ji[..., 0, 6], ji[..., 1, 6] = fx * 2 * x * y, fy * (r2 + 2 * y * y)
    ji[..., 0, 7], ji[..., 1, 7] = fx * (r2 + 2 * x * x), fy * 2 * x * y
    return np.stack([fx * xd + cx, fy * yd + cy], axis=-1), jp, ji
