"""A fit once more, with many columns that it might have had: every question about them is a small ridge regression.

    r(d) = r + J d,    d = -(J_F^T J_F + f I)^-1 J_F^T r_F        (rows whitened, columns in units of the error expected)

F are the rows that a round of a split may learn from, f the variance that is left in units of the noise. What the
added columns do is small against the geometry, so that one linear step is exact to second order; the model that is
handed back is fitted without this shortcut.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Bools, Ints
from robocal.estimate.problem import Problem
from robocal.estimate.terms import Residuals
from robocal.fit.fit import Fit
from robocal.fit.misfit import errors
from robocal.measure.base import problem as build
from robocal.measure.machine import Model
from robocal.prove.split import Split

__all__ = ["Linearised", "linearise_fit", "ridge_matrix"]

CHUNK = 128  # columns at once


@record
class Linearised:
    """Whitened rows with all columns (N, n), the residual as the last column of the Gram matrices, round by round."""

    problem: Problem
    x: Array
    names: tuple[str, ...]
    rows: Array  # (N, n + 1), the last one is the residual
    configuration: Ints  # (N,) of every row
    split: Split
    whole: Array  # (n + 1, n + 1) Gram matrix of all rows
    rounds: Array  # (K, n + 1, n + 1) of the rows that each round may learn from

    @property
    def count(self) -> int:
        """How many numbers were measured that say something of their own."""
        return round(len(self.rows) - self.problem.repeated)

    @cached_property
    def _terms(self) -> list[Residuals]:
        """The residuals of every term at x: of whatever columns, its rows lie alike."""
        return self.problem.residuals(self.x)

    def columns(self, names: Sequence[str]) -> Ints:
        """The numbers of some columns; those that are not there are left out."""
        wanted = set(names)
        return np.flatnonzero([n in wanted for n in self.names])

    def left(self, columns: Ints) -> float:
        """The variance that a fit of these columns to all rows leaves, in units of the noise."""
        step = ridge(self.whole, columns, 1.0)
        r = self.rows[:, -1] + self.rows[:, columns] @ step
        return float(r @ r) / max(self.count - len(columns), 1)

    def observable_count(self, added: Ints, columns: Ints, noise: float) -> int:
        """How many combinations of added columns are seen above the noise, whatever the others are."""
        g = self.whole
        cross = g[np.ix_(columns, added)]
        values = np.linalg.eigvalsh(
            g[np.ix_(added, added)] - cross.T @ np.linalg.solve(ridge_matrix(g, columns, noise), cross)
        )
        return int((values > noise).sum())

    def unseen(
        self, columns: Callable[[int], Ints], noise: Array | float, unit: str, off: Array | float = 0.0
    ) -> tuple[Array, Ints]:
        """Errors of held-out observations in a unit, and their configurations; `columns` gives those of each round. Every column is
        held by `noise` (n,), where it is told one by one, around the value from which it is `off` (n,)."""
        noise, off = (np.broadcast_to(v, len(self.names)) for v in (noise, off))
        turn = self.split.round_of[self.configuration]
        step = np.zeros((len(self.names) + 1, len(self.split)))
        for k in range(len(self.split)):
            chosen = columns(k)
            step[chosen, k] = ridge(self.rounds[k], chosen, noise[chosen], off[chosen])
        # All columns times steps of which most are zero: the product is quicker than a copy of those that are chosen.
        r = self.rows[:, -1] + np.where(turn < 0, 0.0, (self.rows @ step)[np.arange(len(turn)), turn])
        r /= np.sqrt(self.problem.first_weight[self.configuration])
        parts, first = [], 0
        for term in self._terms:
            size = int(term.used.sum()) * term.scale.shape[1]
            value = np.full(term.value.shape, np.nan)
            value[term.used] = r[first : first + size].reshape(-1, term.scale.shape[1]) / term.scale[term.used]
            parts.append(replace(term, value=value))
            first += size
        value, at = errors(parts, unit)
        held = (self.split.round_of[at] >= 0) & ~np.isnan(value)
        return value[held], at[held]


def ridge(gram: Array, columns: Ints, noise: Array | float, off: Array | float = 0.0) -> Array:
    """The step of some columns, in units of the error expected of each, where they are held around the values from which they are
    `off`."""
    inner = ridge_matrix(gram, columns, noise)
    return np.asarray(np.linalg.solve(inner, -gram[columns, -1] - noise * np.asarray(off)))


def ridge_matrix(gram: Array, columns: Ints, noise: Array | float) -> Array:
    """The part of a Gram matrix that some columns have, with what holds them on its diagonal."""
    inner = gram[columns].take(columns, axis=1)
    inner.flat[:: len(columns) + 1] += noise
    return np.asarray(inner)


def linearise_fit(model: Model, part: Fit, added: Sequence[str], split: Split) -> Linearised:
    """The rows of a fit to everything, with the columns that it kept and those of `model` that are added."""
    made = build(model, part.data).with_weights(part.problem.weights)
    x = made.start
    found = dict(zip(part.problem.table.names, part.solution.x[0], strict=False))
    for name, value in found.items():
        if name in made.table:
            x[0, made.table.index[name]] = value
    names = tuple(n for n in made.table.names if n in {*part.problem.free, *added})
    rows = np.empty((0, len(names) + 1))
    for first in range(0, len(names), CHUNK):
        some = made.with_free(names[first : first + CHUNK])
        line = some.linearize(x)
        if not first:
            rows = np.empty((len(line.r), len(names) + 1))
            rows[:, -1] = line.r
        np.multiply(line.j, some.scales, out=rows[:, first : first + CHUNK][:, : some.n])
    return Linearised(made, x, names, rows, line.configuration, split, *_grams(rows, split.fit[:, line.configuration]))


def _grams(rows: Array, fit: Bools) -> tuple[Array, Array]:
    """The Gram matrix of all rows, and those of the rows that each round (K, N) may learn from. Rows of which the same rounds may learn
    are multiplied once."""
    fitted, alike = np.unique(fit, axis=1, return_inverse=True)
    whole, own = np.zeros((2, rows.shape[1], rows.shape[1]))
    rounds = np.zeros((len(fit), *whole.shape))  # what each may not learn from
    for i, learns in enumerate(fitted.T):
        some = rows[alike.ravel() == i]
        np.matmul(some.T, some, out=own)
        whole += own
        for k in np.flatnonzero(~learns):
            rounds[k] += own
    return whole, np.subtract(whole, rounds, out=rounds)
