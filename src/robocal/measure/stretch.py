"""A problem whose residuals are how readings answer to the scale of what read them: the column of a number that nobody fits.

c = dr / ds,    lengths read (or stated) a factor 1 + s too long
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from robocal._types import Array, Ints
from robocal.estimate.problem import Problem
from robocal.measure.rows import Rows

__all__ = ["stretch_columns"]


class _Stretched:
    """A term whose residuals are those of a scale, or zero."""

    def __init__(self, term: Any, counts: bool) -> None:
        self.term, self.counts = term, counts

    def __getattr__(self, name: str) -> Any:
        return getattr(self.term, name)

    def bind(self, column_of: Ints) -> _Stretched:
        """The same with Jacobian columns for what is free."""
        return _Stretched(self.term.bind(column_of), self.counts)

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        """The column in place of residuals, beside the Jacobians."""
        r, j, jl = self.term.evaluate(x, which, first, rows)
        return self.term.stretch(x, r, first, rows) if self.counts else np.zeros_like(r), j, jl


def stretch_columns(problem: Problem, x: Array, some: list[Callable[[Rows], bool]]) -> Array:
    """Whitened columns (N, k) beside the rows of `problem.linearize(x)`, x (1, P): one for each choice of terms that share a scale."""
    bare = problem.with_free(())
    out = []
    for counts in some:
        terms = [_Stretched(t, isinstance(t, Rows) and counts(t)) for t in problem.terms]
        out.append(bare.with_terms(terms).linearize(x).r)
    return np.stack(out, axis=1) if out else np.zeros((len(bare.linearize(x).r), 0))
