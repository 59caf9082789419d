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

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import record
from robocal._types import Array, Bools, Ints

__all__ = ["Hanging", "Rows", "catenary", "hang_by_tension", "invert_small", "newton", "stretch"]

Rows = Ints
ITERATIONS, HALVINGS = 100, 40
RESOLUTION, FOUND = 1e-13, 1e-10  # of the scale: where the search ends, and what counts as a root


@record(eq=False)
class Hanging:
    """Cables in equilibrium: unstretched length (...), force (..., 2) that pulls across and up at B, gradient (..., 2)
    of the length with respect to x and z of B at the same tension, and whether Newton's method got there."""

    length: Array
    force: Array
    gradient: Array
    converged: Bools

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
    of_x = np.stack([e * length + turn - bend, cross, h * e + h / t0], axis=-1)
    of_z = np.stack([cross, e * length + bend, e * v0 + v0 / t0], axis=-1)
    return out, np.stack([of_x, of_z], axis=-2)


def hang_by_tension(ends: ArrayLike, tension: ArrayLike, weight: ArrayLike, elasticity: ArrayLike) -> Hanging:
    """The unstretched length of a cable that pulls with `tension` (...) at its end B, (x, z) (..., 2) from A, x >= 0.

    Of a taut and a deeply sagging cable with the same tension, the taut one. Where no cable hangs so, because the
    tension does not carry its weight, the result is not a number and `converged` false.
    """
    p, given = np.asarray(ends, float), [np.asarray(v, float) for v in (tension, weight, elasticity)]
    shape = np.broadcast_shapes(p.shape[:-1], *(v.shape for v in given))
    p = np.broadcast_to(p, (*shape, 2)).reshape(-1, 2)
    t, w, e = (np.broadcast_to(v, shape).reshape(-1) for v in given)
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

    def in_domain(y: Array) -> Bools:
        return np.asarray((np.abs(y[..., 0]) <= np.pi / 2 + 1e-12) & (y[..., 1] > 0))

    y, jac, good = newton(evaluate, np.stack([angle, length], axis=-1), in_domain, chord)
    force = t[..., None] * np.stack([np.cos(y[..., 0]), np.sin(y[..., 0])], axis=-1)
    found = np.column_stack([y[:, 1], force, invert_small(jac)[:, 1]])
    found[~good] = np.nan
    found = found.reshape(*shape, 5)
    return Hanging(found[..., 0], found[..., 1:3], found[..., 3:], good.reshape(shape))


def invert_small(jac: Array) -> Array:
    """Inverses of 2x2 or 3x3 matrices (..., n, n) by their adjugates; not finite where there is none."""
    if jac.shape[-1] == 2:
        (a, b), (c, d) = np.moveaxis(jac, (-2, -1), (0, 1))
        det, adjugate = a * d - b * c, np.stack([d, -b, -c, a], axis=-1).reshape(jac.shape)
    else:
        x, y, z = (jac[..., i, :] for i in range(3))
        yz = np.cross(y, z)
        det, adjugate = (x * yz).sum(axis=-1), np.stack([yz, np.cross(z, x), np.cross(x, y)], axis=-1)
    return np.asarray(adjugate / np.where(det == 0, np.nan, det)[..., None, None])


def newton(
    evaluate: Callable[[Array, Rows], tuple[Array, Array]],
    start: Array,
    allowed: Callable[[Array], Bools],
    scale: Array,
) -> tuple[Array, Array, Bools]:
    """Roots y (k, n) with the Jacobians there (k, n, n), and which were found (k,): Newton's method with halving.

    evaluate(y, rows) gives the residuals of these rows (r, n) and their Jacobians. A step is taken only to where
    `allowed` says so and the residual is smaller; a row that has arrived, or can take none, is not asked again.
    scale (k,) is the size of what a residual is measured against.
    """
    y = np.array(start)
    with np.errstate(all="ignore"):
        r, jac = evaluate(y, np.arange(len(y)))
        size = np.linalg.norm(r, axis=-1)
        rows = np.flatnonzero(size > RESOLUTION * scale)
        for _ in range(ITERATIONS):
            if not len(rows):
                break
            step = -(invert_small(jac[rows]) @ r[rows][..., None])[..., 0]
            took = np.asarray(np.isfinite(step).all(axis=-1))
            waiting = np.flatnonzero(took)
            for _ in range(HALVINGS):
                at = rows[waiting]
                trial = y[at] + step[waiting]
                new_r, new_jac = evaluate(trial, at)
                new_size = np.linalg.norm(new_r, axis=-1)
                better = allowed(trial) & (new_size < size[at])
                done = at[better]
                for kept, new in ((y, trial), (r, new_r), (jac, new_jac), (size, new_size)):
                    kept[done] = new[better]
                waiting = waiting[~better]
                if not len(waiting):
                    break
                step[waiting] /= 2
            took[waiting] = False
            rows = rows[took]
            rows = rows[size[rows] > RESOLUTION * scale[rows]]
    return y, jac, np.asarray(size <= FOUND * scale)
