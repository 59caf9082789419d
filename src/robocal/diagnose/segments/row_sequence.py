"""Rows in the order in which they were measured, and what may have moved meanwhile."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np

from robocal._record import record
from robocal._types import Array, Ints
from robocal.estimate.problem import Problem
from robocal.estimate.terms import spread
from robocal.fit.noise import owners
from robocal.measure.base import Rows
from robocal.measure.data import DataSet, Observations

__all__ = ["Candidate", "Parts", "Plain", "RowSequence", "whiten_terms"]

Parts = tuple[tuple[int, int, str], ...]  # columns that share a unit: start, stop, SI unit


@record(eq=False)
class Plain:
    """What a candidate does to the readings themselves, where rows are made of them: whitened columns (k, H, q), the standard
    deviations (k, H) of the readings, infinite where there is none, and their parts by unit."""

    column: Array
    sigma: Array
    parts: Parts


@record(eq=False)
class Candidate:
    """What may have moved: `target`, `instrument`, a `zero` or all `zeros`, its name where there are several, and the columns (k, d, q)
    of every row; `plain` tells them of the readings, where rows are something else, and `origin` file and row of those readings."""

    cause: str
    name: str
    column: Array
    plain: Plain | None = None
    origin: list[tuple[str, int]] | None = None

    @cached_property
    def rows(self) -> Ints:
        """The rows that would have seen it."""
        return np.flatnonzero(self.column.any(axis=(1, 2)))


@record(eq=False)
class RowSequence:
    """The rows of one file in order: residual (k, d), Jacobian of everything free (k, d, n), what may have moved, and the
    standard deviations (k, d) by which all that was divided; and what each row weighs, `share` (k,), among
    the visits of its place, `label` (k,)."""

    obs: Observations
    sigma: Array
    residual: Array
    jacobian: Array
    candidates: tuple[Candidate, ...]
    parts: Parts
    share: Array
    label: Ints

    @property
    def count(self) -> float:
        """How many rows say something of their own."""
        return float(self.share.sum())

    def files(self, candidate: Candidate) -> list[tuple[int, int]]:
        """First row and end of every file but the first, where rows of several were joined and each lies together."""
        names = [source for source, _ in candidate.origin or ()]
        starts = [i for i in range(1, len(names)) if names[i] != names[i - 1]]
        if not starts or len(starts) != len(set(names)) - 1:
            return []
        return list(zip(starts, [*starts[1:], len(names)], strict=True))

    def beside(self, candidate: Candidate, first: int, last: int) -> tuple[int, int]:
        """The same rows with those next to them of which nobody knows: held out, or set aside."""
        blind = ~(candidate.column != 0).any(axis=(1, 2))
        while first > 0 and blind[first - 1]:
            first -= 1
        while last + 1 < len(blind) and blind[last + 1]:
            last += 1
        return first, last

    def place(self, candidate: Candidate, first: int, last: int) -> tuple[str, tuple[int, int]]:
        """The file in which most of these rows of a candidate are, and the first and last of them as it numbers them."""
        if candidate.origin is None:
            rows = np.arange(len(self.residual)) if self.obs.rows is None else self.obs.rows
            return self.obs.source, (int(rows[first]), int(rows[last]))
        files = [source for source, _ in candidate.origin[first : last + 1]]
        most = max(dict.fromkeys(files), key=files.count)
        mine = [row for source, row in candidate.origin[first : last + 1] if source == most]
        return most, (mine[0], mine[-1])


def whiten_terms(data: DataSet, problem: Problem, x: Array) -> Iterator[tuple[int, Rows, Array, Array, Array]]:
    """Every term with the number of its observations, and at x (1, P) r (m, d), J (m, d, n), and L (m, d, l) of its blocks.

    All are whitened, and zero for configurations without weight.
    """
    for (own, term), bound in zip(owners(data, problem), problem.bound_terms, strict=True):
        r, narrow, local = bound.evaluate(x, np.zeros(1, dtype=np.int64), 0, len(term.scale))
        used = problem.in_use[term.configuration, None] * term.scale
        j = spread(narrow[0], bound.columns, problem.n)
        yield own, term, r[0] * used, j * used[..., None], local[0] * used[..., None]
