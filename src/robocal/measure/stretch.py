"""A problem whose residuals are how readings answer to the scale of what read them: the column of a number that nobody fits.

c = dr / ds,    lengths read (or stated) a factor 1 + s too long
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from robocal._types import Array, Ints
from robocal.estimate.problem import Problem
from robocal.measure.rows import Rows

__all__ = ["stretch_columns"]


class _Stretched:
    """A term whose residuals are those of a scale."""

    def __init__(self, term: Any) -> None:
        self.term = term

    def __getattr__(self, name: str) -> Any:
        return getattr(self.term, name)

    @property
    def plain(self) -> _Stretched:
        """Its own numbers are of no reading."""
        return self

    def bind(self, column_of: Ints) -> _Stretched:
        """The same with Jacobian columns for what is free."""
        return _Stretched(self.term.bind(column_of))

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        """The column in place of residuals, beside the Jacobians."""
        r, j, jl = self.term.evaluate(x, which, first, rows)
        return self.term.stretch(x, r, first, rows) if isinstance(self.term, Rows) else np.zeros_like(r), j, jl


def stretch_columns(problem: Problem, x: Array, groups: Sequence[Collection[str]]) -> Array:
    """Whitened columns (N, k) beside the rows of `problem.linearize(x)`, x (1, P): one for each choice of groups that share a scale."""
    known = sorted({t.group for t in problem.terms})
    seen = problem.with_free(()).with_terms([_Stretched(t) for t in problem.terms]).linearize(x)
    inside = np.array([[g in some for g in known] for some in groups])
    return np.where(inside[:, seen.group].T, seen.r[:, None], 0.0)
