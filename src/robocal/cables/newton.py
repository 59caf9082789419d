"""Newton's method on many small systems of equations at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from robocal._types import Array

__all__ = ["Rows", "invert_small", "newton"]

Rows = NDArray[np.int64]
ITERATIONS, HALVINGS = 100, 40
RESOLUTION, FOUND = 1e-13, 1e-10  # of the scale: where the search ends, and what counts as a root


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
    allowed: Callable[[Array], NDArray[np.bool_]],
    scale: Array,
) -> tuple[Array, Array, NDArray[np.bool_]]:
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
                y[done], r[done], jac[done], size[done] = (
                    trial[better],
                    new_r[better],
                    new_jac[better],
                    new_size[better],
                )
                waiting = waiting[~better]
                if not len(waiting):
                    break
                step[waiting] /= 2
            took[waiting] = False
            rows = rows[took]
            rows = rows[size[rows] > RESOLUTION * scale[rows]]
    return y, jac, np.asarray(size <= FOUND * scale)
