"""Catenaries as tests ask for them: by their length, point by point, and how deep they sag."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robocal._types import Array
from robocal.cables.elastic import Hanging, Rows, catenary, invert_small, newton


def hang_by_length(ends: ArrayLike, length: ArrayLike, weight: ArrayLike, elasticity: ArrayLike) -> Hanging:
    """The force of cables (...) of unstretched `length` whose ends B are at (x, z) (..., 2) from A, x >= 0.

    The gradient is that of the length at the tension found. A cable that is too short and cannot stretch, or that has
    neither weight nor elasticity, is not converged.
    """
    given = np.asarray(ends, float)
    p = given.reshape(-1, 2)
    length, w, e = (np.broadcast_to(np.asarray(v, float), len(p)) for v in (length, weight, elasticity))
    x, z = p[..., 0], p[..., 1]
    chord = np.linalg.norm(p, axis=-1)
    # Irvine's start for a slack cable, Hooke's for a taut one.
    level = np.maximum(x, 1e-6 * chord)
    lam = np.sqrt(np.maximum(3 * ((length**2 - z**2) / level**2 - 1), 1e-12))
    pull = np.where(e > 0, np.maximum(chord / length - 1, 0) / np.where(e > 0, e, 1), 0)
    slack = length >= chord
    h = np.where(slack, w * level / (2 * np.maximum(lam, 0.05)), pull * level / chord)
    v = np.where(slack, w / 2 * (z / np.tanh(np.maximum(lam, 0.05)) + length), pull * z / chord + w * length / 2)

    def evaluate(y: Array, at: Rows) -> tuple[Array, Array]:
        out, jac = catenary(y, length[at], w[at], e[at])
        return out - p[at], jac[..., :2]

    def in_domain(y: Array) -> NDArray[np.bool_]:
        return np.asarray(y[..., 0] > 0)

    y, _, good = newton(evaluate, np.stack([np.maximum(h, 1e-12), v], axis=-1), in_domain, chord)
    _, jac = catenary(y, length, w, e)
    by_angle = -jac[..., 0] * y[..., 1:] + jac[..., 1] * y[..., :1]
    gradient = invert_small(np.stack([by_angle, jac[..., 2]], axis=-1))[..., 1, :]
    one = given.shape[:-1]
    return Hanging(length.reshape(one), y.reshape(given.shape), gradient.reshape(given.shape), good.reshape(one))


def shape(
    force: Array, length: Array, weight: ArrayLike, elasticity: ArrayLike, count: int = 50
) -> tuple[Array, Array]:
    """Points (..., count, 2) of the cable from A (0, 0) to B, evenly along it, and the tension there (..., count)."""
    w, e = np.asarray(weight, float)[..., None], np.asarray(elasticity, float)[..., None]
    along = np.asarray(length)[..., None] * np.linspace(0, 1, count)
    # The piece from A to a point is a cable by itself; what pulls at its end is V less the weight beyond it.
    v = force[..., 1:] - w * (np.asarray(length)[..., None] - along)
    pull = np.stack([np.broadcast_to(force[..., :1], v.shape), v], axis=-1)
    return catenary(pull, along, w, e)[0], np.linalg.norm(pull, axis=-1)


def sag(force: Array, length: Array, weight: ArrayLike, elasticity: ArrayLike) -> Array:
    """The greatest vertical distance (...) of the cable below the straight line between its ends.

    It is where the cable is parallel to the line: V(s) / H = z / x.
    """
    w, e = np.asarray(weight, float), np.asarray(elasticity, float)
    end, _ = catenary(force, length, w, e)
    slope = end[..., 1] / end[..., 0]
    v = force[..., 0] * slope
    piece = np.clip(length - (force[..., 1] - v) / np.where(w > 0, w, np.inf), 0, length)
    at, _ = catenary(np.stack([force[..., 0], v], axis=-1), piece, w, e)
    return np.asarray(slope * at[..., 0] - at[..., 1])
