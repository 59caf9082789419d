"""Poses from lengths alone, beside what an instrument reads of them: what a robot whose cables are driven is off by.

Frames of the instrument and zeros of a power-up stay where all rows have them.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from robocal._record import replace
from robocal._types import Array
from robocal.diagnose.motions import ABSOLUTE
from robocal.estimate.elimination import block_ranks
from robocal.estimate.problem import Problem
from robocal.fit.free_poses import own_poses
from robocal.fit.misfit import errors
from robocal.measure.base import Rows

__all__ = ["LENGTHS", "kinds_of", "misses_of_lengths", "rows_of_kinds"]

LENGTHS = "lengths"


def kinds_of(problem: Problem) -> list[str]:
    """The kind of measurement of every term; nothing for what is none."""
    return [t.kind if isinstance(t, Rows) else "" for t in problem.terms]


def rows_of_kinds(problem: Problem, kinds: list[str], some: Collection[str]) -> Problem:
    """The rows of some kinds alone."""
    return replace(problem, terms=tuple(t for t, k in zip(problem.terms, kinds, strict=True) if k in some))


def misses_of_lengths(problem: Problem, x: Array) -> tuple[Array, Array]:
    """How far from what instruments read the poses are that lengths alone give, (N,) m and (M,) rad, begun at x (1, P); none where lengths
    tell no pose, and without lengths or such an instrument."""
    kinds, none = kinds_of(problem), np.zeros(0)
    if not problem.families or LENGTHS not in kinds or not set(ABSOLUTE) & set(kinds):
        return none, none
    own, seen = (rows_of_kinds(problem, kinds, some) for some in ((LENGTHS,), ABSOLUTE))
    placed = own_poses(own, x, np.ones((1, problem.configurations), dtype=bool))[0]
    rank = block_ranks(own.with_free(()).with_weights(None).linearize(placed), own.families[0].count)
    told = rank == len(own.families[0].axes)
    (position, at), (turn, there) = (errors(seen.residuals(placed), unit) for unit in ("m", "rad"))
    return position[told[at]], turn[told[there]] if len(there) else none
