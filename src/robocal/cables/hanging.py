"""Sagging cables in space, from eyelets and over swivelling pulleys.

From an eyelet the cable hangs in the vertical plane through its ends (`cables/elastic.py`). Over a pulley of radius r,
which it enters at A along the swivel axis n, it leaves the wheel after the wrap beta where the wheel has swivelled to e:

    leaves at    P = r (1 - cos beta) e + r sin beta n          in the direction  u = sin beta e + cos beta n
    pulls with   F = T0 u + w L z  at its end B, |F| = t        P + catenary(F, L) = B
    length       l = r beta / (1 + e T0) + L

A swivel without friction and weight turns until the cable leaves in the wheel's plane, and there alone: the plane of
wheel and that of the catenary are one where n is vertical, and two where it is not. Newton's method finds the swivel
angle, beta and L together in space, so any n will do. The wrapped part has the tension T0 of the point where it leaves
(its weight, at most 2 r w, is neglected) and stretches by it. No density: stretch over a pulley; no radius: plain sag.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robocal._record import record
from robocal._types import Array
from robocal.cables.elastic import Rows, catenary, hang_by_tension, invert_small, newton
from robocal.cables.pulley import Pulleys, taut

__all__ = ["Hung", "hang"]

UP = np.array([0.0, 0.0, 1.0])
COLUMNS = ((0, ()), (slice(1, 4), (3,)), (slice(4, 7), (3,)), (7, ()))  # of Hung's fields in one array


@record(eq=False)
class Hung:
    """Cables in equilibrium: unstretched length (...) with what is wrapped, its gradient (..., 3) with respect to the
    end B at the same tension there, the force (..., 3) that pulls at B, the wrap (...) in rad. Not numbers where no
    cable hangs so."""

    length: Array
    gradient: Array
    force: Array
    wrap: Array


def hang(
    d: ArrayLike, tension: ArrayLike, weight: ArrayLike, elasticity: ArrayLike, pulleys: Pulleys | None = None
) -> Hung:
    """Cables from frame anchors to their ends d (..., 3) away that pull with `tension` (...) there, in N.

    weight per unstretched length in N/m, elasticity in 1/N; eyelets without pulleys; the base's z points up.
    """
    ends = np.asarray(d, float)
    flat = ends.reshape(-1, 3)
    shape = ends.shape[:-1]
    radius, axis = (0.0, UP) if pulleys is None else (pulleys.radius, pulleys.axis)
    t, w, e, r = (
        np.broadcast_to(np.asarray(v, float), shape).reshape(-1) for v in (tension, weight, elasticity, radius)
    )
    n = np.broadcast_to(np.asarray(axis, float), ends.shape).reshape(-1, 3)
    out = np.empty((len(flat), 8))
    at = ~(r > 0)
    if at.any():
        out[at] = _eyelet(flat[at], t[at], w[at], e[at])
    at = ~at
    if at.any():
        side = taut(flat[at], Pulleys(r[at], n[at]))[3]
        out[at] = _over(_Wheel(flat[at], t[at], w[at], e[at], r[at], n[at], side))
    return Hung(*(out[:, i].reshape((*shape, *more)) for i, more in COLUMNS))


def _eyelet(d: Array, t: Array, w: Array, e: Array) -> Array:
    across = np.hypot(d[:, 0], d[:, 1])
    hung = hang_by_tension(np.stack([across, d[:, 2]], axis=-1), t, w, e)
    out = d[:, :2] / np.where(across > 0, across, np.inf)[:, None]
    turned = [np.concatenate([out * v[:, :1], v[:, 1:]], axis=-1) for v in (hung.gradient, hung.force)]
    return np.column_stack([hung.length, *turned, np.zeros(len(d))])


@record(eq=False)
class _Wheel:
    """Cables (k,) over wheels: the ends d (k, 3), tensions there, weights, elasticities, radii, swivel axes (k, 3), and
    where a taut string's wheel swivels to (k, 3), from where the swivel is counted."""

    d: Array
    t: Array
    w: Array
    e: Array
    r: Array
    n: Array
    side: Array

    def part(self, at: Rows) -> _Wheel:
        """Some of the cables."""
        return _Wheel(*(getattr(self, field.name)[at] for field in fields(self)))

    def guess(self) -> tuple[Array, Array]:
        """Length of the taut string (k,); swivel from its, wrap and unstretched free length (k, 3). A light cable leaves
        lower by half of what its weight takes from its tension."""
        free, beta, _, _ = taut(self.d, Pulleys(self.r, self.n))
        full = self.r * beta + free
        free = free / (1 + self.e * self.t)
        rise = np.cos(beta) * self.side[:, 2] - np.sin(beta) * self.n[:, 2]
        beta = beta - np.minimum(self.w * free / (2 * self.t), 0.5) * rise
        return full, np.stack([np.zeros_like(beta), np.clip(beta, 0, 2 * np.pi), free], axis=-1)

    def at(self, y: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Where the cable ends (k, 3), its derivatives by y (k, 3, 3), length (k,), its derivatives (k, 3), force."""
        side = self.side
        cross = np.cross(self.n, side)
        turn, c, s, free = y[:, :1], np.cos(y[:, 1:2]), np.sin(y[:, 1:2]), y[:, 2]
        e, by_turn = np.cos(turn) * side + np.sin(turn) * cross, np.cos(turn) * cross - np.sin(turn) * side
        u, zero = s * e + c * self.n, np.zeros_like(e)
        u_by = np.stack([s * by_turn, c * e - s * self.n, zero], axis=-1)
        r = self.r[:, None]
        p, p_by = r * ((1 - c) * e + s * self.n), r[..., None] * np.stack([(1 - c) * by_turn, u, zero], axis=-1)
        # T0 from |T0 u + w L z| = t.
        q, up = self.w * free, u[:, 2]
        root = np.sqrt(self.t**2 - q**2 * (1 - up**2))
        t0 = root - q * up
        t0_by = (q**2 * up / root - q)[:, None] * u_by[:, 2]
        t0_by[:, 2] = -self.w * (up + q * (1 - up**2) / root)
        force = t0[:, None] * u + q[:, None] * UP
        force_by = u[..., None] * t0_by[:, None] + t0[:, None, None] * u_by
        force_by[:, 2, 2] += self.w
        run_, by_force, by_free = _hanging(force, free, self.w, self.e)
        ends_by = p_by + by_force @ force_by
        ends_by[..., 2] += by_free
        arc, strain = self.r * y[:, 1], 1 + self.e * t0
        length_by = -(arc * self.e / strain**2)[:, None] * t0_by
        length_by[:, 1] += self.r / strain
        length_by[:, 2] += 1
        return p + run_, ends_by, arc / strain + free, length_by, force


def _hanging(force: Array, length: Array, weight: Array, elasticity: Array) -> tuple[Array, Array, Array]:
    """Way (k, 3) from one end of a catenary to that at which `force` (k, 3) pulls, its derivatives by the force
    (k, 3, 3) and by the length (k, 3)."""
    across = np.hypot(force[:, 0], force[:, 1])
    out = force[:, :2] / np.where(across > 0, across, np.inf)[:, None]
    way, jac = catenary(np.stack([across, force[:, 2]], axis=-1), length, weight, elasticity)
    # x / H, as the limit where nothing pulls across.
    over = np.where(across > 0, way[:, 0] / np.where(across > 0, across, 1), jac[:, 0, 0])
    by_force = np.zeros((len(force), 3, 3))
    by_force[:, :2, :2] = over[:, None, None] * np.eye(2)
    by_force[:, :2, :2] += (jac[:, 0, 0] - over)[:, None, None] * out[:, :, None] * out[:, None]
    by_force[:, :2, 2], by_force[:, 2, :2] = jac[:, 0, 1:2] * out, jac[:, 1, 0:1] * out
    by_force[:, 2, 2] = jac[:, 1, 1]
    ends = np.concatenate([over[:, None] * force[:, :2], way[:, 1:]], axis=-1)
    return ends, by_force, np.concatenate([jac[:, 0, 2:] * out, jac[:, 1, 2:]], axis=-1)


def _over(wheel: _Wheel) -> Array:
    def evaluate(y: Array, at: Rows) -> tuple[Array, Array]:
        part = wheel.part(at)
        place, jac, *_ = part.at(y)
        return place - part.d, jac

    def in_domain(y: Array) -> NDArray[np.bool_]:
        return np.asarray((y[:, 1] > -1e-9) & (y[:, 1] < 2 * np.pi) & (y[:, 2] > 0))

    with np.errstate(all="ignore"):
        full, y = wheel.guess()
        y, _, good = newton(evaluate, y, in_domain, full)
        _, jac, length, by, force = wheel.at(y)
        gradient = np.einsum("ki,kij->kj", by, invert_small(jac))
    found = np.column_stack([length, gradient, force, y[:, 1]])
    return np.where(good[:, None], found, np.nan)
