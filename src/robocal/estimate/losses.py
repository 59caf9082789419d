"""Robust losses by name: their numbers for kernels, their tuning, their weights."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocal._jit import as_kernel_array
from robocal._types import Array, Bools

__all__ = ["LOSSES", "TUNING", "Loss", "slopes"]

LOSSES = {"none": 0, "huber": 1, "cauchy": 2, "tukey": 3}
# Tuning constants for 95 % efficiency under Gaussian noise in one dimension (Holland and Welsch, 1977).
TUNING = {"none": 1.0, "huber": 1.345, "cauchy": 2.385, "tukey": 4.685}


class Loss(NamedTuple):
    """A robust loss as kernels know it: which, its tuning, and of which problems of a batch its curvature counts, (B,)."""

    kind: int
    tuning: float
    curved: Bools


def slopes(loss: str, tuning: float | None, square: Array) -> Array:
    """The robust weights rho' of observations from the squares of their whitened lengths (m,); tuning None: the usual one."""
    from robocal.estimate._kernels import robust_weights

    out = np.ones(len(square))
    if loss != "none":
        robust_weights(LOSSES[loss], tuning or TUNING[loss], as_kernel_array(square), out)
    return out
