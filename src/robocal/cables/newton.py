"""Newton's method on many small systems of equations at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["inverted", "newton"]

Array = NDArray[np.float64]
ITERATIONS, HALVINGS = 100, 40
RESOLUTION, FOUND = 1e-13, 1e-10  # of the scale: where the search ends, and what counts as a root


def inverted(jac: Array) -> Array:
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
    evaluate: Callable[[Array], tuple[Array, Array]],
    y: Array,
    allowed: Callable[[Array], NDArray[np.bool_]],
    scale: Array,
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Roots y (..., n) with the Jacobians there (..., n, n), and which were found (...): Newton's method with halving.

    evaluate(y) gives the residuals (..., n) and their Jacobians; a step is taken only to where `allowed` says so and the
    residual is smaller. scale (...) is the size of what the residual is measured against.
    """
    with np.errstate(all="ignore"):
        r, jac = evaluate(y)
        size = np.linalg.norm(r, axis=-1)
        for _ in range(ITERATIONS):
            step = -(inverted(jac) @ r[..., None])[..., 0]
            running = (size > RESOLUTION * scale) & np.isfinite(step).all(axis=-1)
            if not running.any():
                break
            share = np.where(running, 1.0, 0.0)
            waiting = running
            for _ in range(HALVINGS):
                trial = y + share[..., None] * np.where(running[..., None], step, 0.0)
                new_r, new_jac = evaluate(trial)
                new_size = np.linalg.norm(new_r, axis=-1)
                better = allowed(trial) & (new_size < size)
                waiting = running & ~better
                if not waiting.any():
                    break
                share = np.where(waiting, share / 2, share)
            took = running & ~waiting
            if not took.any():
                break
            y = np.where(took[..., None], trial, y)
            r = np.where(took[..., None], new_r, r)
            jac = np.where(took[..., None, None], new_jac, jac)
            size = np.where(took, new_size, size)
    return y, jac, np.asarray(size <= FOUND * scale)
