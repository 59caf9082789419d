"""Rotations: exp, log and Jacobians of the group SO(3), batched over leading axes.

Rotation vectors w (..., 3) in rad, matrices R (..., 3, 3). Perturbations act on the left: R <- exp(d) R.
Source: Sola, Deray, Atchuthan, A micro Lie theory for state estimation in robotics (2018), section IV and appendix B.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array

__all__ = ["exp", "left_jacobian", "left_jacobian_inverse", "log", "nearest", "project", "roll_pitch_yaw", "skew"]

CHUNK = 4096  # rotations at once: what they pass through is ten times as large as they are


def skew(v: ArrayLike) -> Array:
    """The matrix [v] with [v] u = v x u; v (..., 3) -> (..., 3, 3)."""
    v = np.asarray(v, float)
    out = np.zeros((*v.shape[:-1], 3, 3))
    out[..., 0, 1], out[..., 0, 2] = -v[..., 2], v[..., 1]
    out[..., 1, 0], out[..., 1, 2] = v[..., 2], -v[..., 0]
    out[..., 2, 0], out[..., 2, 1] = -v[..., 1], v[..., 0]
    return out


def _coefficients(w: Array) -> tuple[Array, Array, Array]:
    """sin(t)/t, (1 - cos t)/t^2 and (t - sin t)/t^3 with their series near zero, each (..., 1, 1)."""
    t = np.linalg.norm(w, axis=-1)[..., None, None]
    small = t < 1e-4
    s = np.where(small, 1.0, t)
    a = np.where(small, 1 - t**2 / 6, np.sin(s) / s)
    b = np.where(small, 0.5 - t**2 / 24, 2 * (np.sin(s / 2) / s) ** 2)
    c = np.where(small, 1 / 6 - t**2 / 120, (s - np.sin(s)) / s**3)
    return a, b, c


def exp(w: ArrayLike) -> Array:
    """Rodrigues' formula, I + sin(t)/t [w] + (1 - cos t)/t^2 [w]^2; w (..., 3) -> R (..., 3, 3)."""
    w = np.asarray(w, float)
    if w.ndim == 2 and len(w) > CHUNK:
        return _by_chunks(exp, w)
    a, b, _ = _coefficients(w)
    k = skew(w)
    return np.asarray(np.eye(3) + a * k + b * (k @ k))


def _by_chunks(function: Callable[[Array], Array], given: Array) -> Array:
    return np.concatenate([function(given[i : i + CHUNK]) for i in range(0, len(given), CHUNK)])


def log(rotation: ArrayLike) -> Array:
    """The rotation vector of R with angle in [0, pi], through the quaternion, so exact near 0 and near pi."""
    r = np.asarray(rotation, float)
    if r.ndim == 3 and len(r) > CHUNK:
        return _by_chunks(log, r)
    d = np.stack([r[..., 0, 0], r[..., 1, 1], r[..., 2, 2]], axis=-1)
    trace = d.sum(axis=-1)
    # The four squared quaternion components times four; the largest of them is safe to divide by.
    squares = np.stack([1 + trace, *(1 + 2 * d[..., i] - trace for i in range(3))], axis=-1)
    best = np.argmax(squares, axis=-1)
    wx, wy, wz = r[..., 2, 1] - r[..., 1, 2], r[..., 0, 2] - r[..., 2, 0], r[..., 1, 0] - r[..., 0, 1]
    q = np.stack([squares[..., 0], wx, wy, wz], axis=-1)
    if best.any():  # turns beyond 90 degrees, at the least
        xy, xz, yz = r[..., 0, 1] + r[..., 1, 0], r[..., 0, 2] + r[..., 2, 0], r[..., 1, 2] + r[..., 2, 1]
        q1 = np.stack([wx, squares[..., 1], xy, xz], axis=-1)
        q2 = np.stack([wy, xy, squares[..., 2], yz], axis=-1)
        q3 = np.stack([wz, xz, yz, squares[..., 3]], axis=-1)
        q = np.choose(best[..., None], [q, q1, q2, q3])
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    q = np.where(q[..., :1] < 0, -q, q)
    n = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    factor = np.where(n < 1e-12, 2.0, 2 * np.arctan2(n, q[..., :1]) / np.where(n < 1e-12, 1.0, n))
    return np.asarray(factor * q[..., 1:])


def roll_pitch_yaw(rotation: ArrayLike) -> Array:
    """Roll, pitch, yaw (..., 3) in rad with R = Rz(yaw) Ry(pitch) Rx(roll), pitch in [-pi/2, pi/2]; at the poles roll takes the whole turn.

    Roll is what yaw leaves of R, so that the three give R again however near to a pole it is, where each alone is not known.
    """
    r = np.asarray(rotation, float)
    flat = np.hypot(r[..., 0, 0], r[..., 1, 0])
    # tolerance: rounding of a product of rotations
    yaw = np.where(flat < 1e-14, 0.0, np.arctan2(r[..., 1, 0], r[..., 0, 0]))
    c, s = np.cos(yaw), np.sin(yaw)
    roll = np.arctan2(s * r[..., 0, 2] - c * r[..., 1, 2], c * r[..., 1, 1] - s * r[..., 0, 1])
    return np.stack([roll, np.arctan2(-r[..., 2, 0], flat), yaw], axis=-1)


def left_jacobian(w: ArrayLike) -> Array:
    """J with exp(w + d) = exp(J d) exp(w) to first order; w (..., 3) -> (..., 3, 3)."""
    w = np.asarray(w, float)
    _, b, c = _coefficients(w)
    k = skew(w)
    return np.asarray(np.eye(3) + b * k + c * (k @ k))


def left_jacobian_inverse(w: ArrayLike) -> Array:
    """The inverse of `left_jacobian`: log(exp(d) exp(w)) = w + Jinv d to first order; valid for |w| < 2 pi."""
    w = np.asarray(w, float)
    t = np.linalg.norm(w, axis=-1)[..., None, None]
    small = t < 1e-3
    s = np.where(small, 1.0, t)
    half = s / 2
    e = np.where(small, 1 / 12 + t**2 / 720, (1 - half * np.cos(half) / np.where(small, 1.0, np.sin(half))) / s**2)
    k = skew(w)
    return np.asarray(np.eye(3) - 0.5 * k + e * (k @ k))


def project(matrix: ArrayLike) -> Array:
    """The rotation nearest to a 3x3 matrix in the Frobenius norm (SVD with determinant +1)."""
    u, _, vt = np.linalg.svd(np.asarray(matrix, float))
    sign = np.linalg.det(u @ vt)
    u = u.copy()
    u[..., :, 2] *= np.where(sign < 0, -1.0, 1.0)[..., None]
    return np.asarray(u @ vt)


def nearest(w: ArrayLike, reference: ArrayLike) -> Array:
    """Of the vectors w + 2 pi k w/|w|, which are one rotation, the one nearest to `reference`; both (..., 3) rad."""
    w = np.asarray(w, float)
    angle = np.linalg.norm(w, axis=-1, keepdims=True)
    safe = np.where(angle > 0, angle, 1.0)
    along = (w * reference).sum(axis=-1, keepdims=True) / safe
    return np.asarray(w * (1 + 2 * np.pi * np.rint((along - angle) / (2 * np.pi)) / safe))
