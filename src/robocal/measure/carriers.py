"""Carriers: where a frame is, as a function of the parameters.

T (B, m, 4, 4), J (B, m, 6, k) for the free parameters and J (B, m, 6, l) for local blocks, those of the first family (poses)
before those of the second (targets); rows of J are (v, w) of
the end frame in the coordinates of the first. A sensor kind sees these and never a machine, so the same kind serves
an arm, a fixed instrument and a cable platform.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, Self

import numpy as np

from robocal._record import field, record, replace
from robocal._types import Array, Ints
from robocal.errors import ModelError
from robocal.geometry.path.program import Program

__all__ = [
    "Carrier", "Gathered", "Inverse", "KnownPose", "LocalPose", "PathCarrier", "Product", "join_blocks", "locals_of",
]  # fmt: skip

NONE = np.empty(0, dtype=np.int64)
Locals = tuple[Ints | None, Ints | None]


class Carrier(Protocol):
    """Where a frame is, as a function of the parameters."""

    @property
    def columns(self) -> Ints:
        """Tangent columns of J, (k,)."""

    @property
    def local(self) -> Locals:
        """The block of every row, (m,), of the first and of the second family, or None."""

    @property
    def moves(self) -> bool:
        """Whether the frame is elsewhere at other configurations."""

    def bind(self, column_of: Ints) -> Carrier:
        """The same frame with Jacobian columns for the free table rows."""

    def hold(self, family: int) -> Carrier:
        """The same frame, where the blocks of a family (0 or 1) stay where x has them."""

    def pose(self, x: Array, first: int, rows: int, turn: bool = True) -> tuple[Array, Array, Array]:
        """T, J, J of the local block; J has only its three upper rows when turn is False."""


@record
class PathCarrier:
    """A compiled path of elements: an arm with the frames before and behind it, or frames alone."""

    program: Program
    phi: Array  # (1, M, C)
    trig: Array  # (1, M, C, 2): the rows never change, so their cosines are taken once
    columns: Ints = field(default_factory=lambda: NONE)
    entries: tuple[Ints, Array] | None = None
    local: Locals = (None, None)

    @property
    def moves(self) -> bool:
        return bool(self.program.columns)

    def bind(self, column_of: Ints) -> PathCarrier:
        columns, entries = self.program.bound(column_of)
        return PathCarrier(self.program, self.phi, self.trig, columns, entries, self.local)

    def hold(self, family: int) -> PathCarrier:
        return self

    def pose(self, x: Array, first: int, rows: int, turn: bool = True) -> tuple[Array, Array, Array]:
        t, j = self.program.run(x, self.phi, self.entries, len(self.columns), turn, first, rows, self.trig)
        return t, j, j[..., :0]


@record
class LocalPose:
    """A pose of its own for every block of a family (0 or 1): x[at + 6 i : at + 6 i + 6] is the frame vector of block i of
    `count`, `axes` are the components that are free."""

    block: Ints
    at: int
    count: int
    axes: tuple[int, ...] = (0, 1, 2, 3, 4, 5)
    family: int = 0
    columns: Ints = field(default_factory=lambda: NONE)
    moves: bool = True

    @property
    def local(self) -> Locals:
        if not self.axes:
            return None, None
        return (None, self.block) if self.family else (self.block, None)

    def bind(self, column_of: Ints) -> LocalPose:
        return self

    def hold(self, family: int) -> LocalPose:
        return replace(self, axes=()) if family == self.family else self

    def pose(self, x: Array, first: int, rows: int, turn: bool = True) -> tuple[Array, Array, Array]:
        from robocal.measure._kernels import frames_of

        high = 6 if turn else 3
        t = np.empty((len(x), rows, 4, 4))
        frames_of(np.ascontiguousarray(x), self.at, self.block[first : first + rows], t)
        jl = np.empty((len(x), rows, high, len(self.axes)))
        jl[:] = np.eye(6)[:high, list(self.axes)]
        return t, np.empty((len(x), rows, high, 0)), jl


@record
class KnownPose:
    """Poses that are known, T (m, 4, 4): nothing about them is to be found."""

    known: Array
    columns: Ints = field(default_factory=lambda: NONE)
    local: Locals = (None, None)
    moves: bool = True

    def bind(self, column_of: Ints) -> KnownPose:
        return self

    def hold(self, family: int) -> KnownPose:
        return self

    def pose(self, x: Array, first: int, rows: int, turn: bool = True) -> tuple[Array, Array, Array]:
        t = np.ascontiguousarray(np.broadcast_to(self.known[first : first + rows], (len(x), rows, 4, 4)))
        none = np.empty((len(x), rows, 6 if turn else 3, 0))
        return t, none, none


@record
class _Wrapped:
    """What follows from another carrier row by row: it has the columns and moves as the inner one does."""

    inner: Carrier

    @property
    def columns(self) -> Ints:
        return self.inner.columns

    @property
    def local(self) -> Locals:
        return self.inner.local

    @property
    def moves(self) -> bool:
        return self.inner.moves

    def bind(self, column_of: Ints) -> Self:
        return replace(self, inner=self.inner.bind(column_of))

    def hold(self, family: int) -> Self:
        return replace(self, inner=self.inner.hold(family))


@record
class Gathered(_Wrapped):
    """A carrier that many rows share: row i is the inner one's row which[i], and that is computed once."""

    which: Ints

    @property
    def local(self) -> Locals:
        one, two = (None if block is None else block[self.which] for block in self.inner.local)
        return one, two

    def pose(self, x: Array, first: int, rows: int, turn: bool = True) -> tuple[Array, Array, Array]:
        own = self.which[first : first + rows]
        lo, hi = (int(own.min()), int(own.max()) + 1) if rows else (0, 0)
        t, j, jl = self.inner.pose(x, lo, hi - lo, turn)
        own = own - lo
        return t.take(own, axis=1), j.take(own, axis=1), jl.take(own, axis=1)


@record
class Inverse(_Wrapped):
    """The inverse of a carrier."""

    def pose(self, x: Array, first: int, rows: int, turn: bool = True) -> tuple[Array, Array, Array]:
        from robocal.measure._kernels import inverse_kernel

        t, j, jl = self.inner.pose(x, first, rows)
        high = 6 if turn else 3
        out, both = np.empty_like(t), np.empty((*t.shape[:2], high, j.shape[3] + jl.shape[3]))
        inverse_kernel(t, np.concatenate([j, jl], axis=3), out, both)
        own = j.shape[3]
        return out, np.ascontiguousarray(both[..., :own]), np.ascontiguousarray(both[..., own:])


@record
class Product:
    """The product of two carriers, with local blocks of different families."""

    a: Carrier
    b: Carrier

    @property
    def columns(self) -> Ints:
        return np.concatenate([self.a.columns, self.b.columns])

    @property
    def local(self) -> Locals:
        return locals_of((self.a, self.b))

    @property
    def moves(self) -> bool:
        return self.a.moves or self.b.moves

    def bind(self, column_of: Ints) -> Product:
        return Product(self.a.bind(column_of), self.b.bind(column_of))

    def hold(self, family: int) -> Product:
        return Product(self.a.hold(family), self.b.hold(family))

    def pose(self, x: Array, first: int, rows: int, turn: bool = True) -> tuple[Array, Array, Array]:
        from robocal.measure._kernels import product_kernel

        ta, ja, la = self.a.pose(x, first, rows)
        tb, jb, lb = self.b.pose(x, first, rows)
        out = np.empty_like(ta)
        ka, kb, na = ja.shape[3], jb.shape[3], la.shape[3]
        both = np.empty((*ta.shape[:2], 6 if turn else 3, ka + na + kb + lb.shape[3]))
        if la.shape[3]:
            ja = np.concatenate([ja, la], axis=3)
        if lb.shape[3]:
            jb = np.concatenate([jb, lb], axis=3)
        product_kernel(ta, ja, tb, jb, out, both)
        if not na and not lb.shape[3]:
            return out, both, both[..., :0]
        shared = np.concatenate([both[..., :ka], both[..., ka + na : ka + na + kb]], axis=3)
        return out, shared, join_blocks((self.a, self.b), both[..., ka : ka + na], both[..., ka + na + kb :])


def locals_of(carriers: Sequence[Carrier]) -> Locals:
    """The block of every row, (m,), of the first and of the second family, or None. Raises ModelError when two carriers have one
    of the same: a row may touch one free pose only."""
    found = [[c.local[i] for c in carriers if c.local[i] is not None] for i in (0, 1)]
    if max(map(len, found)) > 1:
        expected = "a machine with joints, or targets that are not eliminated"
        raise ModelError("a measurement between two free poses", found="two local blocks", expected=expected)
    return found[0][0] if found[0] else None, found[1][0] if found[1] else None


def join_blocks(carriers: Sequence[Carrier], a: Array, b: Array) -> Array:
    """Columns of the local blocks of two carriers, (..., l) and (..., q), the first family's first."""
    if not a.shape[-1] or not b.shape[-1]:
        return np.ascontiguousarray(a if a.shape[-1] else b)
    return np.concatenate([a, b] if carriers[0].local[0] is not None else [b, a], axis=-1)
