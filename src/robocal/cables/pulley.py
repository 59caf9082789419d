"""A cable over a swivelling pulley: it enters at a along the swivel axis n, wraps, and leaves on a tangent.

In the plane that n spans with d = B - a (B: the platform anchor), with h = n . d and s = |d - h n|, the pulley of
radius r has its centre at (s, h) = (r, 0). With e = (s - r, h):

    free segment   f = sqrt(|e|^2 - r^2)
    wrap angle     beta = atan2(h, r - s) - atan2(f, r), in [0, 2 pi)
    length         l = r beta + f

The taut string moves its end along itself, so dl/dB is the unit vector of the free segment,
u = sin(beta) d_perp / s + cos(beta) n; the pulley turns with B and does not matter to first order. By the radius it is
beta - sin(beta), and by the axis, which stays a unit vector, (s cos(beta) - h sin(beta)) d_perp / s.
Source: Pott, Cable-Driven Parallel Robots (2018), section 4.2.5 (the extended kinematics of one pulley).
"""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array

__all__ = ["Pulleys", "by_wheel", "curvature", "leaving", "run", "taut"]


@record(eq=False)
class Pulleys:
    """Radii (...) in m and swivel axes (..., 3): the unit direction in which the cable enters at the frame anchor,
    base axes. Radius 0: a plain eyelet. Those of a robot are (m,) and (m, 3)."""

    radius: Array
    axis: Array


def run(d: Array, pulleys: Pulleys | None) -> tuple[Array, Array]:
    """Length (...) from the frame anchor to the end d (..., 3) away, and the unit vector (..., 3) in which the cable
    arrives; straight without pulleys. Not a number where d lies inside a pulley."""
    if pulleys is None:
        full = np.linalg.norm(d, axis=-1)
        return full, d / np.where(full > 0, full, np.inf)[..., None]
    free, beta, _, side = taut(d, pulleys)
    return pulleys.radius * beta + free, np.sin(beta)[..., None] * side + np.cos(beta)[..., None] * pulleys.axis


def leaving(d: Array, pulleys: Pulleys | None) -> Array:
    """Where the cable leaves its wheel (..., 3), from the frame anchor: d - f u; zero without pulleys."""
    if pulleys is None:
        return np.zeros_like(d)
    free, beta, _, side = taut(d, pulleys)
    u = np.sin(beta)[..., None] * side + np.cos(beta)[..., None] * pulleys.axis
    return np.asarray(np.where((pulleys.radius > 0)[..., None], d - free[..., None] * u, 0.0))


def by_wheel(d: Array, pulleys: Pulleys) -> Array:
    """Derivatives (..., 4) of the length by the radius and by the three numbers of an axis of length 1."""
    _, beta, s, side = taut(d, pulleys)
    h = (d * pulleys.axis).sum(axis=-1)
    turning = s * np.cos(beta) - h * np.sin(beta)
    return np.concatenate([(beta - np.sin(beta))[..., None], turning[..., None] * side], axis=-1)


def curvature(d: Array, pulleys: Pulleys | None) -> Array:
    """Second derivative (..., 3, 3) of the length by the end d (..., 3): how the direction in which the cable arrives
    turns with it.

    It is m m^T / f + sin(beta) q q^T / s, with q across the wheel's plane (the swivel follows) and m in it, square to
    the cable (the tangent rolls on); (I - u u^T) / l for straight cables. Not finite where the swivel is undetermined.
    """
    if pulleys is None:
        full, u = run(d, None)
        return np.asarray((np.eye(3) - u[..., :, None] * u[..., None, :]) / full[..., None, None])
    n = pulleys.axis
    free, beta, s, side = taut(d, pulleys)
    q, m = np.cross(n, side), np.cos(beta)[..., None] * side - np.sin(beta)[..., None] * n
    with np.errstate(divide="ignore", invalid="ignore"):
        swivels, rolls = (np.sin(beta) / s)[..., None, None], (1 / free)[..., None, None]
        out = rolls * m[..., :, None] * m[..., None, :] + swivels * q[..., :, None] * q[..., None, :]
    # An eyelet has no wheel whose plane could be undetermined.
    return np.where((pulleys.radius > 0)[..., None, None], out, curvature(d, None))


def taut(d: Array, pulleys: Pulleys) -> tuple[Array, Array, Array, Array]:
    """Free segment f (...), wrap angle beta (...), and the distance s (...) of the end d from the swivel axis with the unit
    vector (..., 3) along it, away from the axis."""
    radius, n = pulleys.radius, pulleys.axis
    h = (d * n).sum(axis=-1)
    across = d - h[..., None] * n
    s = np.linalg.norm(across, axis=-1)
    square = s * (s - 2 * radius) + h * h
    free = np.sqrt(np.where(square >= 0, square, np.nan))
    beta = np.arctan2(h, radius - s) - np.arctan2(free, radius)
    # Straight ahead the wrap is zero; rounding must not make a whole turn of it.
    beta = np.where(beta < -1e-9, beta + 2 * np.pi, beta)
    # Radius zero is a plain distance; beta is then the angle between n and d by the same formula.
    return free, beta, s, across / np.where(s > 0, s, np.inf)[..., None]
