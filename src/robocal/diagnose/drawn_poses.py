"""Poses of their own that one instrument has drawn away from the others.

A configuration whose pose is found by the fit goes where most of its rows pull, and a loss that resists rows does not resist a view of
sixty: then all instruments seem to be off there. So the pose is found again without each of them in turn. Where the others agree
without one, and without that one alone, it is what is off; else all of them stay far.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array, Bools
from robocal.diagnose.limits import VIEW_FAR
from robocal.diagnose.studentised import studentise
from robocal.estimate.least_squares import least_squares
from robocal.estimate.problem import Problem
from robocal.fit.noise import Tau, by_observation, owners
from robocal.measure.base import kind_of
from robocal.measure.data import DataSet

__all__ = ["restore_poses"]


def restore_poses(
    data: DataSet, problem: Problem, x: Array, tau: Tau, far: Sequence[Bools]
) -> tuple[Array, tuple[Bools, ...]]:
    """x (1, P) and the rows (k,) of every observation that are far, where poses were found again without what drew them away; `problem`
    has every row, without a loss."""
    far = tuple(far)
    own = bool(problem.families) and problem.families[0].count == problem.configurations
    if not own or not any(f.any() and kind_of(o).views for o, f in zip(data.observations, far, strict=True)):
        return x, far
    off = _off(data, far)
    crowded = off.sum(axis=0) > 1
    if not crowded.any():
        return x, far
    tried = np.flatnonzero(off[:, crowded].any(axis=1))
    there = [crowded[o.configuration] for o in data.observations]
    agree = np.zeros((len(tried), len(crowded)), dtype=bool)
    found = []
    for k, suspect in enumerate(tried):
        # Elsewhere what is far stays out, and at these places one instrument alone.
        out = [np.where(t, i == suspect, f) for i, (t, f) in enumerate(zip(there, far, strict=True))]
        made = problem.without([out[i][term.index] for i, term in owners(data, problem)]).with_free(())
        y = least_squares(made, x).x
        left = by_observation(data, made, studentise(made, y, tau).far)
        found.append((y, left))
        others = _off(data, left)
        others[suspect] = False
        agree[k] = crowded & ~others.any(axis=0)
    alone = agree.sum(axis=0) == 1
    place = problem.places[0]
    poses = np.array(x[:, place]).reshape(problem.configurations, -1)
    result = [f.copy() for f in far]
    for k, suspect in enumerate(tried):
        mine = alone & agree[k]
        y, left = found[k]
        poses[mine] = y[:, place].reshape(poses.shape)[mine]
        for i, obs in enumerate(data.observations):
            rows = mine[obs.configuration]
            result[i][rows] = left[i][rows] | (i == suspect)
    x = np.array(x)
    x[:, place] = poses.ravel()
    return x, tuple(result)


def _off(data: DataSet, far: Sequence[Bools]) -> Bools:
    """Which instruments are off at which configurations, (O, U): most of their rows there are far."""
    out = np.zeros((len(far), len(data.configurations)), dtype=bool)
    for row, obs, mine in zip(out, data.observations, far, strict=True):
        count, many = (np.bincount(obs.configuration, w, len(row)) for w in (None, mine))
        row[:] = many > VIEW_FAR * count
    return out
