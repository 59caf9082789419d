"""Laws that several tests hold code to."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Function = Callable[[Array], ArrayLike]


def numeric_jacobian(
    fn: Function,
    x: ArrayLike,
    *,
    step: float = 1e-4,
    add: Callable[[Array, Array], Array] = np.add,
    subtract: Callable[[Array, Array], ArrayLike] = np.subtract,
) -> Array:
    """d fn / d x by central differences of fourth order, shape of fn(x) + (n,).

    (8 (f(h) - f(-h)) - (f(2h) - f(-2h))) / 12 h: the error is of order h^4 + eps / h, about 1e-12 for functions of
    order one. `add` moves x by a tangent step, `subtract` gives the tangent difference of two values; both are plain
    for vectors.
    """
    x = np.asarray(x, float)
    columns = []
    for i in range(x.size):
        e = np.zeros(x.size)
        e[i] = step
        near = np.asarray(subtract(np.asarray(fn(add(x, e))), np.asarray(fn(add(x, -e)))), float)
        far = np.asarray(subtract(np.asarray(fn(add(x, 2 * e))), np.asarray(fn(add(x, -2 * e)))), float)
        columns.append((8 * near - far) / (12 * step))
    return np.stack(columns, axis=-1)


def check_jacobian(
    fn: Function,
    jac: Function,
    x: ArrayLike,
    *,
    tolerance: float = 1e-8,
    step: float = 1e-4,
    add: Callable[[Array, Array], Array] = np.add,
    subtract: Callable[[Array, Array], ArrayLike] = np.subtract,
) -> None:
    """Asserts that jac(x), shape of fn(x) + (n,), is the derivative of fn at x, and that no column could be wrong
    unseen.

    The error of a column is relative to the largest entry of J. Then every column is spoilt in turn (scaled by 1.001,
    or, where it is zero, set to a thousandth of the largest entry), and the same comparison must refuse it: so a test
    that cannot fail fails here.
    """
    given, truth = (
        np.asarray(jac(np.asarray(x, float)), float),
        numeric_jacobian(fn, x, step=step, add=add, subtract=subtract),
    )
    assert given.shape == truth.shape, f"jacobian has shape {given.shape}, central differences {truth.shape}"
    assert truth.size and np.isfinite(given).all(), "jacobian is empty or not finite"
    size = max(float(np.abs(truth).max()), 1e-300)

    def worst(candidate: Array) -> tuple[float, tuple[int, ...]]:
        error = np.abs(candidate - truth) / size
        at = np.unravel_index(int(error.argmax()), error.shape)
        return float(error[at]), tuple(int(i) for i in at)

    error, at = worst(given)
    assert error < tolerance, (
        f"jacobian is wrong by {error:.1e} at {at}: {given[at]:.12g}, differences say {truth[at]:.12g}"
    )
    for i in range(truth.shape[-1]):
        spoilt = given.copy()
        column = spoilt[..., i]
        column[...] = column * 1.001 if np.abs(column).max() > 1e-3 * size else column + 1e-3 * size
        assert worst(spoilt)[0] > tolerance, f"a wrong column {i} would go unseen"
