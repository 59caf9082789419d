"""Poses that belong to configurations nobody fitted: each is fitted to its own rows, with everything shared frozen.

What is left of N numbers that had to give a pose of p is too small by sqrt((N - p) / N); errors are enlarged by the
inverse. As many numbers as the pose has are always met: they say nothing.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Bools
from robocal.estimate.elimination import block_ranks
from robocal.estimate.least_squares import least_squares
from robocal.estimate.problem import Problem

__all__ = ["own_poses"]

LESS = 1e-3  # of what a configuration leaves, that is worth another pose


def own_poses(
    problem: Problem, x: Array, configurations: Bools, other: Array | None = None
) -> tuple[Array, Array, bool]:
    """x (B, P) with the poses of some configurations (B, U) fitted to their own rows, the factor of what these rows leave,
    (B, U), and whether every fit converged. Other poses stay. `other` frame vectors (U, 6) are one more place where each may begin;
    the one that leaves less counts."""
    # Targets that are blocks too belong to everybody, like any shared column: a held-out row must not move them.
    kept = problem.with_fixed_blocks(1) if len(problem.families) > 1 else problem
    alone = kept.with_free(()).with_weights(configurations.astype(float))
    solved = least_squares(alone, x)
    place, width = problem.places[0], problem.families[0].width
    out = np.array(x)
    mine = np.repeat(configurations, width, axis=1)
    out[:, place] = np.where(mine, solved.x[:, place], x[:, place])
    reasons = [*solved.reasons]
    if other is not None:
        begun = np.array(x)
        begun[:, place] = np.where(mine, other.ravel(), x[:, place])
        again = least_squares(alone, begun)
        pairs = zip(out, again.x, strict=True)
        less = np.array([_left(problem, b[None]) < (1 - LESS) * _left(problem, a[None]) for a, b in pairs])
        out[:, place] = np.where(mine & np.repeat(less, width, axis=1), again.x[:, place], out[:, place])
        both = zip(reasons, again.reasons, less & configurations, strict=True)
        reasons = [two if new.any() else one for one, two, new in both]
    numbers = problem.numbers.astype(float)
    rank = block_ranks(alone.with_weights(None).linearize(x[:1]), problem.families[0].count)
    known = numbers > rank
    factor = np.where(known, np.sqrt(numbers / np.where(known, numbers - rank, 1.0)), np.nan)
    return out, np.where(configurations, factor, 1.0), all(r.converged for r in reasons)


def _left(problem: Problem, x: Array) -> Array:
    """Sum of squares of the whitened residuals of every configuration (U,) at x (1, P)."""
    out = np.zeros(problem.configurations)
    for r in problem.residuals(x):
        np.add.at(out, r.configuration, (r.white**2).sum(axis=-1))
    return out
