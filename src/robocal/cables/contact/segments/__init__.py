"""Distances between segments, compiled and batched."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robocal._jit import as_kernel_array

__all__ = ["distances"]


def distances(p: ArrayLike, p_end: ArrayLike, q: ArrayLike, q_end: ArrayLike) -> NDArray[np.float64]:
    """The distance in m between segments p p_end and q q_end, points (k, 3) each -> (k,)."""
    from robocal.cables.contact.segments._kernels import separations

    arrays = np.broadcast_arrays(*(np.asarray(x, float) for x in (p, p_end, q, q_end)))
    one, one_end, two, two_end = as_kernel_array(*arrays)
    out = np.empty(len(one))
    separations(one, one_end, two, two_end, out)
    return out
