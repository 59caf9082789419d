"""Cables that stretch and sag: the elastic catenary between two points.

A cable of unstretched length L, weight w per unstretched length and elasticity e = 1/EA hangs from A to B, x across and
z up. (H, V) is the force that pulls at its end B, V0 = V - w L what is left of V at A, T1 = |(H, V)| and T0 = |(H, V0)|
the tensions at B and A, S = T1 + T0:

    x = H (e L + (2 / w) atanh(w L / S))          z = (e + 2 / S) L (V + V0) / 2

This is Irvine's pair with asinh(V/H) - asinh(V0/H) = 2 atanh(w L / S) and T1 - T0 = w L (V + V0) / S, which lose no
digits when the cable is light (w = 0 is a straight spring). Newton's method solves for (H, V) from L, or for L and the
direction of the force from the tension at B. Source: Irvine, Cable Structures (1981), section 1.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robocal._types import Array
from robocal.cables.newton import Rows, invert_small, newton

__all__ = ["Hanging", "catenary", "hang_by_tension", "stretch"]


@dataclass(frozen=True, eq=False)
class Hanging:
    """Cables in equilibrium: unstretched length (...), force (..., 2) that pulls across and up at B, gradient (..., 2)
    of the length with respect to x and z of B at the same tension, and whether Newton's method got there."""

    length: Array
    force: Array
    gradient: Array
    converged: NDArray[np.bool_]

    @property
    def tension(self) -> Array:
        """Tension at B, (...)."""
        return np.asarray(np.linalg.norm(self.force, axis=-1))


def stretch(full: Array, tension: ArrayLike, elasticity: ArrayLike) -> tuple[Array, Array, Array]:
    """Unstretched length l = full / (1 + e t) of straight cables under tension, and its derivatives by the full length
    and by the tension."""
    t, e = np.asarray(tension, float), np.asarray(elasticity, float)
    strain = 1 + e * t
    return full / strain, 1 / strain, -full * e / strain**2


def catenary(force: Array, length: Array, weight: ArrayLike, elasticity: ArrayLike) -> tuple[Array, Array]:
    """Where B is, (x, z) (..., 2) from A, and the derivatives (..., 2, 3) with respect to H, V and the unstretched
    length."""
    h, v = force[..., 0], force[..., 1]
    w, e = np.asarray(weight, float), np.asarray(elasticity, float)
    v0 = v - w * length
    t1, t0 = np.hypot(h, v), np.hypot(h, v0)
    s = t1 + t0
    ratio = np.minimum(w * length / s, 1 - 1e-16)
    small = ratio < 1e-4
    safe = np.where(small, 0.5, ratio)
    over = np.where(small, 1 + ratio**2 / 3, np.arctanh(safe) / safe)
    turn = 2 * length / s * over
    bend = length * (h * h + t1 * t0 - v * v0) / (s * t1 * t0)
    out = np.stack([h * (e * length + turn), (e + 2 / s) * length * (v + v0) / 2], axis=-1)
    cross = -h * length * (v + v0) / (s * t1 * t0)
    jac = np.stack(
        [
            np.stack([e * length + turn - bend, cross, h * e + h / t0], axis=-1),
            np.stack([cross, e * length + bend, e * v0 + v0 / t0], axis=-1),
        ],
        axis=-2,
    )
    return out, jac


def hang_by_tension(ends: ArrayLike, tension: ArrayLike, weight: ArrayLike, elasticity: ArrayLike) -> Hanging:
    """The unstretched length of a cable that pulls with `tension` (...) at its end B, (x, z) (..., 2) from A, x >= 0.

    Of a taut and a deeply sagging cable with the same tension, the taut one. Where no cable hangs so, because the
    tension does not carry its weight, the result is not a number and `converged` false.
    """
    shape, p, t, w, e = _together(ends, tension, weight, elasticity)
    chord = np.linalg.norm(p, axis=-1)
    length = chord / (1 + e * t)
    # The tension of a light cable turns by half of what its weight takes from it.
    with np.errstate(all="ignore"):
        turned = np.where(t > 0, np.minimum(w * length * p[..., 0] / chord / (2 * t), 0.5), np.nan)
    angle = np.arctan2(p[..., 1], p[..., 0]) + turned
    angle = np.clip(angle, -np.pi / 2, np.pi / 2)

    def evaluate(y: Array, at: Rows) -> tuple[Array, Array]:
        force = t[at, None] * np.stack([np.cos(y[..., 0]), np.sin(y[..., 0])], axis=-1)
        out, jac = catenary(force, y[..., 1], w[at], e[at])
        by_angle = -jac[..., 0] * force[..., 1:] + jac[..., 1] * force[..., :1]
        return out - p[at], np.stack([by_angle, jac[..., 2]], axis=-1)

    def in_domain(y: Array) -> NDArray[np.bool_]:
        return np.asarray((np.abs(y[..., 0]) <= np.pi / 2 + 1e-12) & (y[..., 1] > 0))

    y, jac, good = newton(evaluate, np.stack([angle, length], axis=-1), in_domain, chord)
    force = t[..., None] * np.stack([np.cos(y[..., 0]), np.sin(y[..., 0])], axis=-1)
    return _result(shape, y[..., 1], force, invert_small(jac)[..., 1, :], good)


def _together(ends: ArrayLike, *more: ArrayLike) -> tuple[tuple[int, ...], Array, Array, Array, Array]:
    """The common shape (...), and all that is given in one row."""
    p = np.asarray(ends, float)
    given = [np.asarray(m, float) for m in more]
    shape = np.broadcast_shapes(p.shape[:-1], *(m.shape for m in given))
    one, two, three = (np.broadcast_to(m, shape).reshape(-1) for m in given)
    return shape, np.broadcast_to(p, (*shape, 2)).reshape(-1, 2), one, two, three


def _result(shape: tuple[int, ...], length: Array, force: Array, gradient: Array, good: NDArray[np.bool_]) -> Hanging:
    bad = ~good
    return Hanging(
        np.where(bad, np.nan, length).reshape(shape),
        np.where(bad[..., None], np.nan, force).reshape(*shape, 2),
        np.where(bad[..., None], np.nan, gradient).reshape(*shape, 2),
        good.reshape(shape),
    )
