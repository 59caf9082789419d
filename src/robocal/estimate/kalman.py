"""The extended Kalman filter over configurations, on the same problem as least squares.

    S = H P H^T + I,  K = P H^T S^-1,  x <- x (+) K (-r - H e),  P <- (I - K H) P (I - K H)^T + K K^T

r and H are whitened, so the measurement noise is the identity. e is the step from the prior to the current iterate
(zero in the first pass: the plain EKF; more passes are the iterated EKF). A local block enters at its prior, is
updated with its configuration's rows and marginalised. Source: Bell and Cathey, The iterated Kalman filter update as
a Gauss-Newton method (1993).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robocal.errors import ModelError
from robocal.estimate.problem import Problem

__all__ = ["Filtered", "kalman"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Filtered:
    """Where the filter ended: x (1, P), covariance of the free columns (n, n)."""

    x: Array
    covariance: Array


def kalman(
    problem: Problem,
    x: Array | None = None,
    *,
    covariance: Array | None = None,
    local_sigma: float = 1.0,
    passes: int = 1,
    watch: Callable[[dict[str, object]], None] | None = None,
) -> Filtered:
    """Filters the units of a problem in order, starting from x (1, P) with covariance (n, n).

    The default covariance is that of the priors, or of the expected errors where no prior is stated. Raises
    ModelError when a local block is seen from several units: it could not be marginalised.
    """
    x = problem.start if x is None else np.atleast_2d(np.asarray(x, float))
    n, size = problem.n, problem.block_size
    p = np.diag(problem.scales**2) if covariance is None else np.array(covariance)
    owner: dict[int, int] = {}
    for term in problem.terms:
        for block, unit in {(int(b), int(u)) for b, u in zip(term.local, term.unit, strict=True) if b >= 0}:
            if owner.setdefault(block, unit) != unit:
                raise ModelError(
                    "the filter needs every local block to belong to one configuration", found=f"block {block}"
                )
    for unit in range(problem.units):
        big: Array = np.zeros((n + size, n + size))
        big[:n, :n] = p
        big[n:, n:] = np.eye(size) * local_sigma**2
        moved: Array = np.zeros(n + size)
        gain: Array = np.zeros((0, 0))
        h: Array = np.zeros((0, 0))
        for _ in range(passes):
            lin = problem.linearize(x, np.array([unit]))
            if not len(lin.r):
                break
            blocks = np.unique(lin.local[lin.local >= 0])
            if len(blocks) > 1:
                raise ModelError("the filter takes one local block per configuration", found=f"{len(blocks)} blocks")
            h = np.hstack([lin.j, lin.jl])
            gain = np.asarray(np.linalg.solve(h @ big @ h.T + np.eye(len(h)), h @ big), dtype=np.float64).T
            target: Array = gain @ (h @ moved - lin.r)
            step = target - moved
            local = np.zeros((1, problem.blocks, size))
            if size:
                local[0, blocks] = step[n:]
            x = problem.retract(x, step[None, :n], local if size else None)
            moved = target
        if len(h):
            keep = np.eye(n + size) - gain @ h
            # Joseph's form stays symmetric and positive where the short form does not.
            p = (keep @ big @ keep.T + gain @ gain.T)[:n, :n]
        if watch:
            watch({"stage": "filter", "unit": unit, "units": problem.units})
    return Filtered(x, p)
