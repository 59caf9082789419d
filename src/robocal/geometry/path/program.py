"""A path of elementary transforms, and its compiled form.

    T(theta, row) = prod_e exp(s_e v_e),    v_e = v0_e + sum_k factor_k theta[parameter_k] phi[row, column_k]

s_e is a fixed axis (tx ty tz rx ry rz), a unit screw, or the six of a frame. The columns phi are joint values and
whatever else a configuration carries (temperature, torque, sign of approach), so joint gains, compliance and growth
are coefficients like any other. The Jacobian of a coefficient is phi times the element's screw carried to the base.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocal._record import record, replace
from robocal._types import Array, Bools, Ints
from robocal.errors import ModelError, one_of
from robocal.parameters import FRAME_SYMBOLS, ParameterTable

__all__ = ["AXES", "Element", "Joint", "Program", "Term", "Zero", "compile_path", "frame_element", "offset_matrix"]

Entries = tuple[Ints, Array]  # of a Jacobian: indices (n, 5) and factors (n,)
Bound = tuple[Ints, Entries]  # columns, and entries of the Jacobian
KEPT = 256  # sets of free columns
AXES = ("tx", "ty", "tz", "rx", "ry", "rz", "screw", "frame")


@record
class Term:
    """One summand of an element's value: factor * theta[parameter] * phi[column]; column "1" is the constant one."""

    parameter: str
    column: str = "1"
    factor: float = 1.0


@record
class Element:
    """One elementary transform; `screw` (v, w) is read only when `axis` is "screw"."""

    axis: str
    terms: tuple[Term, ...] = ()
    constant: float = 0.0
    screw: tuple[float, ...] = (0.0,) * 6

    def __hash__(self) -> int:
        return self._hash

    def without(self, names: frozenset[str]) -> Element:
        """The same without the columns that some parameters, which are zero, multiply."""
        kept = tuple([t for t in self.terms if t.column == "1" or t.parameter not in names])
        return self if len(kept) == len(self.terms) else replace(self, terms=kept)

    @cached_property
    def _hash(self) -> int:  # of every element of every path that is asked for
        return hash((self.axis, self.terms, self.constant, self.screw))


@lru_cache(maxsize=256)
def frame_element(owner: str) -> Element:
    """The element of a whole frame whose six parameters are `owner.x` ... `owner.rz`."""
    return Element("frame", tuple(Term(f"{owner}.{s}") for s in FRAME_SYMBOLS))


@record
class Joint:
    """A driven axis: its column phi is called `name`; limits in rad or m."""

    name: str
    type: str = "revolute"
    lower: float = -math.inf
    upper: float = math.inf


@record
class Zero:
    """A joint, the parameter that shifts where it counts from, and the change of that parameter per offset of the joint; `others` are
    joints that count with it, and how much of each."""

    joint: str
    parameter: str
    factor: float
    others: tuple[tuple[str, float], ...] = ()


def offset_matrix(zeros: Sequence[Zero]) -> Array:
    """The changes of the parameters per offset of the joints, (n, n)."""
    at = {z.joint: i for i, z in enumerate(zeros)}
    out = np.eye(len(zeros))
    for i, z in enumerate(zeros):
        for other, share in z.others:
            if other in at:
                out[i, at[other]] = share
    return np.array([z.factor for z in zeros])[:, None] * out


@record
class Program:
    """A path in plain arrays, as the kernel reads it; `columns` are the names of the phi it needs."""

    elements: Ints
    constants: Array
    screws: Array
    start: Ints
    terms: Ints
    factor: Array
    columns: tuple[str, ...]

    @cached_property
    def parameters(self) -> Ints:
        """The table rows that the path depends on, ascending."""
        return np.unique(self.terms[:, 0])

    @cached_property
    def turning(self) -> tuple[Ints, Ints]:
        """The columns that alone turn an element about an axis where the others' parameters are zero, the first of each element, and the
        place of every column among them or -1, (C,)."""
        varying = (self.terms[self.start[e] : self.start[e + 1], 1] for e in np.flatnonzero(self._about))
        alone = {int(own[own >= 0][0]) for own in varying}
        found = np.array(sorted(alone), dtype=np.int64)
        place = np.full(len(self.columns), -1, dtype=np.int64)
        place[found] = np.arange(len(found))
        return found, place

    @property
    def _about(self) -> Bools:
        kind, varies = self.elements.T
        return np.asarray((kind >= 3) & (kind < 6) & (varies == 1))

    def cosines(self, phi: Array, *, rough: bool = False) -> Array:
        """cos and sin of the columns that may alone turn something, (..., D, 2); others are summed before a sine is taken.

        Where three roundings do no harm, `rough` takes t = tan(a / 2), and (1 - t^2) / (1 + t^2) and 2 t / (1 + t^2): numpy has one
        tangent many times faster than a cosine and a sine.
        """
        found = self.turning[0]
        angle = phi if len(found) == phi.shape[-1] else phi[..., found]
        out = np.empty((*angle.shape, 2))
        if rough:
            half = np.tan(0.5 * angle)
            share = 2.0 / (1.0 + half * half)
            out[..., 0], out[..., 1] = share - 1.0, half * share
            return out
        np.cos(angle, out=out[..., 0])
        np.sin(angle, out=out[..., 1])
        return out

    def entries(self, column_of: Ints) -> Entries:
        """Jacobian entries for parameters: column_of (P,) gives the output column of a table row, or -1."""
        parameter, column = self.terms.T
        kept = np.flatnonzero(column_of[parameter] >= 0)
        e = self._element_of[kept]
        frame = self.elements[e, 0] == 7
        part, driver = np.where(frame, kept - self.start[e], 0), np.where(frame, -1, column[kept])
        return _table(e, part, column_of[parameter[kept]], driver, -1), self.factor[kept]

    def bound(self, column_of: Ints) -> Bound:
        """What a Jacobian needs to know of the free columns (P,), those of table rows or -1: worked out once for each set."""
        key = column_of.tobytes()
        found = self._bound.get(key)
        if found is None:
            if len(self._bound) >= KEPT:
                self._bound.clear()
            used = self.parameters
            used = used[column_of[used] >= 0]
            output = np.full(len(column_of), -1, dtype=np.int64)
            output[used] = np.arange(len(used))
            found = self._bound[key] = column_of[used], self.entries(output)
        return found

    @cached_property
    def _bound(self) -> dict[bytes, Bound]:
        return {}

    def joint_entries(self, joints: Sequence[str]) -> Entries:
        """Jacobian entries for joint values; column i of the output is joints[i]."""
        parameter, column = self.terms.T
        driven = np.array(
            [*(joints.index(c) if c in joints else -1 for c in self.columns), -1]
        )  # the last: the constant one
        kept = np.flatnonzero(driven[column] >= 0)
        return _table(self._element_of[kept], 0, driven[column[kept]], -1, parameter[kept]), self.factor[kept]

    @property
    def _element_of(self) -> Ints:
        """The element of every term."""
        return np.repeat(np.arange(len(self.elements)), np.diff(self.start))

    def run(
        self,
        theta: Array,
        phi: Array,
        entries: Entries | None = None,
        width: int = 0,
        turn: bool = True,
        first: int = 0,
        rows: int | None = None,
        trig: Array | None = None,
    ) -> tuple[Array, Array]:
        """T (B, m, 4, 4) and J (B, m, 6 or 3, width); theta (B, P), phi (1 or B, M, C), rows first .. first + m.

        `trig` is `self.cosines(phi)`, for callers that come back with the same phi.
        """
        m = phi.shape[1] - first if rows is None else rows
        pose = np.empty((theta.shape[0], m, 4, 4))
        jac = np.empty((theta.shape[0], m, 6 if turn else 3, width))
        e, f = entries if entries is not None else _NO_ENTRIES
        kernel, parts = self._kernel_and_arrays
        kernel(*parts, theta, phi, self.cosines(phi) if trig is None else trig, self.turning[1], e, f, first, pose, jac)
        return pose, jac

    @cached_property
    def _kernel_and_arrays(self) -> tuple[Callable[..., None], tuple[NDArray[Any], ...]]:
        """The kernel and the arrays of the program that it reads."""
        from robocal.geometry.path._kernels import path_kernel

        return path_kernel, (self.elements, self.constants, self.screws, self.start, self.terms, self.factor)


def _table(*columns: Ints | int) -> Ints:
    """Columns, some of them one number, as the kernel reads them."""
    return np.ascontiguousarray(np.stack(np.broadcast_arrays(*columns), axis=1), dtype=np.int64)


_NO_ENTRIES = (np.empty((0, 5), dtype=np.int64), np.empty(0))


def compile_path(elements: Iterable[Element], table: ParameterTable) -> Program:
    """Turns elements into arrays against a parameter table. Raises ModelError for a parameter that the table lacks."""
    try:
        return _compile(tuple(elements), table.names)
    except KeyError as missing:
        _ = table[missing.args[0]]
        raise


@lru_cache(maxsize=64)
def _compile(elements: tuple[Element, ...], names: tuple[str, ...]) -> Program:
    """One identification asks for the same few paths dozens of times."""
    index = {name: i for i, name in enumerate(names)}
    kinds, constants, screws, start, terms, factors = [], [], [], [0], [], []
    columns: list[str] = []
    for element in elements:
        if element.axis not in AXES:
            raise ModelError("unknown axis of an element", found=element.axis, **one_of(element.axis, AXES))
        varies = False
        for term in element.terms:
            column = -1
            if term.column != "1":
                if term.column not in columns:
                    columns.append(term.column)
                column, varies = columns.index(term.column), True
            terms.append((index[term.parameter], column))
            factors.append(term.factor)
        start.append(len(terms))
        kinds.append((AXES.index(element.axis), int(varies)))
        constants.append(element.constant)
        screws.append(element.screw)
    return Program(
        np.array(kinds, dtype=np.int64).reshape(-1, 2),
        np.array(constants, dtype=float),
        np.array(screws, dtype=float).reshape(-1, 6),
        np.array(start, dtype=np.int64),
        np.array(terms, dtype=np.int64).reshape(-1, 2),
        np.array(factors, dtype=float),
        tuple(columns),
    )
