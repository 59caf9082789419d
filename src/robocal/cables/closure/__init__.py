"""How evenly cables can pull in all directions: wrench closure, tension factor, condition number.

All three are properties of a structure matrix W alone; neither weight nor tension limits take part.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import record
from robocal._types import Array, Bools
from robocal.cables.statics import row_weights, structures

__all__ = ["CLOSED", "Dexterity", "condition_number", "dexterity", "tension_factor"]

CLOSED = 1e-9  # tolerance: a smaller tension factor is made of rounding


@record(eq=False)
class Dexterity:
    """Of k poses: `tension_factor` (k,) in [0, 1], 0 where not every wrench can be balanced; `condition` (k,) >= 1 of the structure
    matrix, infinite where it is singular; `length` in m, by which moments are divided in it."""

    tension_factor: Array
    condition: Array
    length: float

    @property
    def in_closure(self) -> Bools:
        """Whether cables that pull, as strongly as it takes, can balance any wrench, (k,)."""
        return np.asarray(self.tension_factor > CLOSED)


def tension_factor(structure: ArrayLike) -> Array:
    """The greatest min(t) / max(t) (k,) of tensions t >= 0 with W t = 0; 0 where W has not full rank, or no such t > 0 exists.

    W [x, 1]^m has 0 in it as long as no hyperplane of d - 1 cables has it on one side. With s = n^T W of such a normal n, and P and N
    the sums of its positive entries and of the sizes of its negative ones, that is x <= min(P / N, N / P): the factor is the least of
    these over all hyperplanes. Above 0, and only then, the pose is wrench-closed. structure (k, d, m), any units of moments.
    Raises ModelError for another shape. Quantity: Pham, Yeo, Yang and Chen (2009); closure: Gouttefarde and Gosselin (2006).
    """
    from robocal.cables.closure._kernels import factor_kernel

    w = structures(structure)
    out = np.zeros(len(w))
    if w.shape[2] > w.shape[1]:
        factor_kernel(w, out)
    return out


def condition_number(structure: ArrayLike, length: ArrayLike = 1.0) -> Array:
    """Greatest by least singular value (k,) of W, its rows of moments divided by `length` in m; infinite where W is singular.

    structure (k, d, m); length one number, or of every row (d,), 1 for forces. Raises ModelError for another shape.
    """
    w = structures(structure)
    if w.shape[2] < w.shape[1]:
        return np.full(len(w), np.inf)
    sizes = np.linalg.svd(w * row_weights(w.shape[1], length)[:, None], compute_uv=False)
    least = np.where(sizes[:, -1] > 1e-12 * sizes[:, 0], sizes[:, -1], 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(least > 0.0, sizes[:, 0] / least, np.inf)


def dexterity(structure: ArrayLike, length: ArrayLike = 1.0) -> Dexterity:
    """Tension factor and condition number of structure matrices (k, d, m); `length` as for `condition_number`."""
    return Dexterity(tension_factor(structure), condition_number(structure, length), float(np.max(length)))
