"""Poses that belong to configurations nobody fitted: each is fitted to its own rows, with everything shared frozen.

What is left of N numbers that had to give a pose of p is too small by sqrt((N - p) / N); errors are enlarged by the
inverse. As many numbers as the pose has are always met: they say nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robocal.estimate.elimination import block_ranks
from robocal.estimate.least_squares import least_squares
from robocal.estimate.problem import Problem

__all__ = ["own_poses"]

Array = NDArray[np.float64]


def own_poses(problem: Problem, x: Array, configurations: NDArray[np.bool_]) -> tuple[Array, Array, bool]:
    """x (B, P) with the poses of some configurations (B, U) fitted to their own rows, the factor of what these rows leave,
    (B, U), and whether every fit converged. Other poses stay."""
    # Targets that are blocks too belong to everybody, like any shared column: a held-out row must not move them.
    kept = problem.with_held(1) if len(problem.families) > 1 else problem
    alone = kept.with_free(()).with_weights(configurations.astype(float))
    solved = least_squares(alone, x)
    place, width = problem.places[0], problem.families[0].width
    out = np.array(x)
    mine = np.repeat(configurations, width, axis=1)
    out[:, place] = np.where(mine, solved.x[:, place], x[:, place])
    numbers = problem.numbers.astype(float)
    rank = block_ranks(alone.with_weights(None).linearize(x[:1]), problem.families[0].count)
    known = numbers > rank
    factor = np.where(known, np.sqrt(numbers / np.where(known, numbers - rank, 1.0)), np.nan)
    return out, np.where(configurations, factor, 1.0), all(r.converged for r in solved.reasons)
