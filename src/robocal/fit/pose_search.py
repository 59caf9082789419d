"""Poses of single configurations, begun at those of all others: one that ended in a wrong valley makes good rows look gross.

Every pose is tried for every configuration that is asked, at the cost of its own rows; fits begin from the few that leave least.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Bools
from robocal.estimate.least_squares import least_squares
from robocal.estimate.problem import Problem

__all__ = ["search_costly_poses", "search_single_poses"]

TRIED = 60  # grid: poses that are tried
COSTLY = (
    4.0  # tolerance: times what most cost, or noise does: a search costs little, and changes nothing of a right pose
)
BEGUN = 3  # grid: of these, from how many a fit begins
CLEARLY = 0.9  # tolerance: of the cost of its rows: a pose that leaves no less than that stays


def search_costly_poses(problem: Problem, x: Array, which: Bools) -> Array:
    """The same of those of some configurations (U,) whose rows cost many times what most do."""
    if not problem.families or problem.families[0].count != problem.configurations:
        return x
    problem = problem.with_loss("huber")
    cost = _costs(problem.with_free(()), x)[0] / np.maximum(problem.numbers, 1)
    seen = problem.numbers > 0
    usual = float(np.median(cost[seen])) if seen.any() else 0.0
    return search_single_poses(problem, x, which & seen & (cost > COSTLY * max(usual, 1.0)))


def search_single_poses(problem: Problem, x: Array, which: Bools) -> Array:
    """x (1, P) with other poses of some configurations (U,), where their own rows are clearly cheaper there, by the problem's loss."""
    if not which.any() or not problem.families or problem.families[0].count != problem.configurations:
        return x
    alone, place = problem.with_free(()).with_weights(which[None].astype(float)), problem.places[0]
    poses = x[0, place].reshape(problem.configurations, -1)
    some = poses[np.unique(np.linspace(0, len(poses) - 1, TRIED).astype(np.int64))]
    many = np.repeat(x, len(some), axis=0)
    many[:, place] = np.tile(some[:, None], (1, len(poses), 1)).reshape(len(some), -1)
    order = np.argsort(_costs(alone, many), axis=0, kind="stable")
    best, cost = np.array(x), _costs(alone, x)[0]
    for k in range(min(BEGUN, len(some))):
        begun = np.array(x)
        there = np.where(which[:, None], some[order[k]], poses)
        begun[:, place] = there.ravel()
        ended = least_squares(alone, begun, max_iterations=30, cost_tolerance=1e-6).x
        less = _costs(alone, ended)[0]
        take = which & (less < CLEARLY * cost)
        cost = np.where(take, less, cost)
        best[:, place] = np.where(np.repeat(take, poses.shape[1]), ended[:, place], best[:, place])
    return best


def _costs(problem: Problem, x: Array) -> Array:
    """The cost of the rows of every configuration at x (B, P), (B, U)."""
    out = np.zeros((len(x), problem.configurations))
    for b, one in enumerate(x):
        for term, r in zip(problem.terms, problem.residuals(one[None]), strict=True):
            square = np.where(r.used, (r.white**2).sum(axis=-1), 0.0)
            out[b] += np.bincount(term.configuration, _rho(problem, square, r.reading), problem.configurations)
    return np.where(np.isfinite(out), out, np.inf)


def _rho(problem: Problem, square: Array, reading: bool) -> Array:
    """The loss of squares of whitened lengths; a square grows no faster than its slope."""
    return problem.slope(square, reading) * square
