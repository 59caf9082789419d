"""The unknowns of a least-squares problem: a parameter table, which of its columns are free, local blocks, and what is believed of
them before anything is measured."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from robocal._record import cached_property, record
from robocal._types import Array, Bools, Ints
from robocal.estimate.families import Family
from robocal.estimate.priors import PriorTerms, covariance_root, shared_root
from robocal.parameters import ParameterTable

__all__ = ["Unknowns"]


class Layout:
    """Where free columns of these names lie in a table: the row of each, (n,), the column of every row or -1, (P,), and how they move:
    rotation vectors with a free component, their columns, and rows and columns of what simply adds."""

    def __init__(self, table: ParameterTable, free: Sequence[str]) -> None:
        self.index = np.array([table.index[name] for name in free], dtype=np.int64)
        self.column_of = column_of = np.full(len(table), -1, dtype=np.int64)
        column_of[self.index] = np.arange(len(self.index))
        at = np.array([t for t in table.turns if (column_of[t : t + 3] >= 0).any()], dtype=np.int64)
        columns = np.array([column_of[t : t + 3] for t in at], dtype=np.int64).reshape(-1, 3)
        turning = set(columns.ravel().tolist())
        adds = np.array([c for c in range(len(self.index)) if c not in turning], dtype=np.int64)
        self.turns = at, columns, self.index[adds], adds


@record
class Unknowns:
    """x (B, P) stacks B parameter vectors of the table and the local blocks of at most two families; it is moved by steps in the
    tangent space of the free columns and of the blocks."""

    table: ParameterTable
    free: tuple[str, ...]
    families: tuple[Family, ...] = ()  # of local blocks: at most two
    priors: bool = True

    @property
    def blocks(self) -> int:
        """How many local blocks there are, of all families."""
        return sum(f.count for f in self.families)

    @cached_property
    def sizes(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """Blocks and columns of a block, of the first and of the second family."""
        one, two = ([*((f.count, f.size) for f in self.families), (0, 0), (0, 0)])[:2]
        return one, two

    @cached_property
    def places(self) -> list[slice]:
        """Where in x the blocks of each family lie, behind the numbers of the table."""
        ends = len(self.table) + np.cumsum([0, *(f.start.size for f in self.families)])
        return [slice(int(a), int(b)) for a, b in pairwise(ends)]

    def values_of(self, family: int, x: Array) -> Array:
        """The blocks of one family at x (B, P): (B, L, w)."""
        return x[:, self.places[family]].reshape(len(x), *self.families[family].start.shape)

    @property
    def n(self) -> int:
        """Number of free columns."""
        return len(self.free)

    @property
    def start(self) -> Array:
        """x at the table's values, shape (1, P)."""
        return self._start.copy()

    @cached_property
    def _start(self) -> Array:
        return np.concatenate([self.table.values, *(f.start.ravel() for f in self.families)])[None]

    @cached_property
    def _layout(self) -> Layout:
        known = self.table.layouts
        if self.free not in known:
            known[self.free] = Layout(self.table, self.free)
        found: Layout = known[self.free]
        return found

    @property
    def index(self) -> Ints:
        """The table row of every free column, shape (n,)."""
        return self._layout.index

    @property
    def column_of(self) -> Ints:
        """The column of every table row, or -1, shape (P,)."""
        return self._layout.column_of

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the free columns, each (n,)."""
        low, high = self.table.bounds.take(self.index, axis=1)  # rows, as a kernel takes them
        return low, high

    @cached_property
    def has_bounds(self) -> bool:
        """Whether any free column has a bound."""
        return bool(np.isfinite(self.bounds[0]).any() or np.isfinite(self.bounds[1]).any())

    @cached_property
    def has_prior(self) -> Bools:
        """Which free columns have a stated prior, (n,)."""
        return np.asarray((self.table.priors[self.index] != 0) & self.priors)

    @cached_property
    def _any_prior(self) -> bool:
        return bool(self.has_prior.any())

    @cached_property
    def prior_informs(self) -> Bools:
        """Which free columns have a stated prior that says how far off they are, (n,)."""
        return np.asarray(self.has_prior & self.table.prior_informs[self.index])

    @cached_property
    def prior_root(self) -> Array:
        """R (n, n), R^T R the information of the stated priors: rows beside those of the data, of the step from the table's values."""
        return shared_root(self.table, self.free) if self.priors else np.zeros((self.n, self.n))

    @cached_property
    def _pull(self) -> PriorTerms:
        return PriorTerms(self.prior_root, self._layout.turns[1])

    @property
    def information(self) -> Array:
        """P (n, n) of the stated priors."""
        return self._pull.whole

    @property
    def even(self) -> bool:
        """Whether the normal equations hold J^T J + P as it stands: no prior of a rotation vector differs by axis."""
        return not self._pull.bent

    @cached_property
    def spread_root(self) -> Array:
        """S (n, n), S S^T the covariance expected without data: diagonal, but where a stated prior says more."""
        return covariance_root(self.table, self.free, self.scales) if self.priors else np.diag(self.scales)

    @cached_property
    def scales(self) -> Array:
        """The error expected of every free column without data, (n,); a stated prior says it, unless priors are off."""
        return (self.table.scales if self.priors else self.table.usual)[self.index]

    @cached_property
    def preference(self) -> Ints:
        """Which free column is rather kept where the data cannot tell it from another: the higher, (n,)."""
        return self.table.preferences[self.index]

    def retract(self, x: Array, step: Array, *local: Array) -> Array:
        """x moved by a tangent step: x (B, P), step (B, n), and of each family (B, L, l) where its blocks move too; rotation
        vectors move on the group."""
        out = np.array(x)
        self._moves[0](out, np.ascontiguousarray(step), *self._layout.turns)
        for family, place, moved in zip(self.families, self.places, local, strict=False):
            out[:, place] = family.advance(out[:, place], moved)
        return out

    def difference(self, x: Array) -> Array:
        """The tangent step from the prior mean to x, (B, n)."""
        out = np.zeros((len(x), self.n))
        self._moves[1](np.ascontiguousarray(x), self._start[0], *self._layout.turns, out)
        return out

    @cached_property
    def _moves(self) -> tuple[Callable[..., None], ...]:  # an import costs as much as a small kernel
        from robocal.geometry._kernels import add_step, step_between

        return add_step, step_between
