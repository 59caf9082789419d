"""The table of named parameters: what a machine is made of, one row per number.

A name reads `owner.symbol` (`j2.alpha`, `tool.x`, `tracker.rz`). Values are SI and radians. Three consecutive rows
whose `turn` is true are one rotation vector: they are stepped on the group, R <- exp(w) R, never by adding components.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robocal.errors import ModelError, nearest

__all__ = ["FRAME_SYMBOLS", "Parameter", "ParameterTable", "Together", "check_covariance", "frame_parameters"]

FRAME_SYMBOLS = ("x", "y", "z", "rx", "ry", "rz")

# What a parameter is expected to be off by when nobody states a prior: typical of a factory-built arm.
TYPICAL = {"m": 1e-3, "rad": 5e-3, "1": 1e-3}
WIDE = 1e3  # a metre, any angle: so far off, nothing is known
ROUNDING = 1e-13


@dataclass(frozen=True)
class Parameter:
    """One named number.

    `prior` is the standard deviation of a stated prior around `value` (None: no prior). `scale` is the size of the
    error that one expects without data; it decides what counts as seen, never what is estimated. Of columns that the
    data cannot tell apart, the one with the higher `preference` is kept. `source` says where it comes from.
    """

    name: str
    value: float = 0.0
    unit: str = "m"
    free: bool = False
    prior: float | None = None
    lower: float = -math.inf
    upper: float = math.inf
    turn: bool = False
    expected: float | None = None
    source: str = ""
    preference: int = 0

    @property
    def scale(self) -> float:
        """The error expected without data, in the parameter's unit: what a prior says, unless it says nothing."""
        return self.prior if self.prior is not None and self.prior_informs else self.usual

    @property
    def prior_informs(self) -> bool:
        """Whether a stated prior says how far off the parameter is: one beyond WIDE times what is typical, and wider than what
        is expected without it, says nothing. It still pulls, as little as it does."""
        return self.prior is not None and self.prior <= max(self.usual, WIDE * TYPICAL.get(self.unit, 1.0))

    @property
    def usual(self) -> float:
        """The error expected when nobody states a prior, in the parameter's unit."""
        return self.expected if self.expected is not None else TYPICAL.get(self.unit, 1.0)


def _replace(p: Parameter, **changes: object) -> Parameter:
    """As `dataclasses.replace`, which costs ten times as much: tables are made anew at every step of an identification."""
    made = object.__new__(type(p))
    made.__dict__.update(p.__dict__, **changes)
    return made


@dataclass(frozen=True)
class Together:
    """A prior of several parameters together: their covariance (k, k) around their values, SI, in the order of `names`.
    Components of a rotation vector are turns, as everywhere in a covariance. Each name's own `Parameter.prior` is the root
    of its diagonal."""

    names: tuple[str, ...]
    covariance: tuple[tuple[float, ...], ...]

    def of(self, names: Sequence[str]) -> NDArray[np.float64]:
        """The covariance of some of the names, in the given order; what is not asked is left open, not held."""
        at = [self.names.index(n) for n in names]
        return np.array(self.covariance)[np.ix_(at, at)]

    def without(self, names: Iterable[str]) -> Together:
        """What it says of the other names."""
        gone = set(names)
        rest = tuple(n for n in self.names if n not in gone)
        return self if len(rest) == len(self.names) else _together(rest, self.of(rest))


def _together(names: tuple[str, ...], covariance: NDArray[np.float64]) -> Together:
    return Together(names, tuple(map(tuple, covariance.tolist())))


def frame_parameters(
    owner: str,
    value: Sequence[float] = (0.0,) * 6,
    *,
    free: bool | Sequence[bool] = False,
    expected: tuple[float, float] | None = None,
    source: str = "",
) -> tuple[Parameter, ...]:
    """The six rows (x, y, z, rx, ry, rz) of a frame: translation in m, rotation vector in rad, shape of `value`
    (6,)."""
    frees = (free,) * 6 if isinstance(free, bool) else tuple(free)
    rows = []
    for i, symbol in enumerate(FRAME_SYMBOLS):
        scale = None if expected is None else expected[i // 3]
        unit = "m" if i < 3 else "rad"
        rows.append(
            Parameter(f"{owner}.{symbol}", float(value[i]), unit, frees[i], turn=i >= 3, expected=scale, source=source)
        )
    return tuple(rows)


# How unequal the two halves of a covariance may be, relative to its standard deviations: what writing it down leaves.
SYMMETRIC = 1e-6


def check_covariance(c: NDArray[np.float64], size: int, key: str) -> None:
    """Raises ModelError where c (..., size, size) is no covariance; `key` says whose prior it is."""
    if c.shape[-2:] != (size, size):
        raise ModelError("a prior's covariance has another size", key=key, found=c.shape, expected=f"{size} x {size}")
    if not np.isfinite(c).all():
        raise ModelError("a prior's covariance must be finite", key=key)
    own = np.diagonal(c, axis1=-2, axis2=-1)
    if not (own > 0).all():
        raise ModelError("a prior's variances must be above zero", key=key, found=float(own.min()))
    unit = c / np.sqrt(own[..., :, None] * own[..., None, :])
    if (np.abs(unit - np.swapaxes(unit, -1, -2)) > SYMMETRIC).any():
        raise ModelError("a prior's covariance must be symmetric", key=key)
    # Units differ by orders of magnitude, so it is the correlations whose eigenvalues say whether it is one.
    least = float(np.linalg.eigvalsh(unit).min(initial=np.inf))
    if not least > ROUNDING:
        raise ModelError(
            "a prior's covariance must be positive definite",
            key=key,
            found=f"smallest eigenvalue of the correlations {least:.3g}",
            expected="above 0; parameters that depend on each other exactly cannot have priors of their own",
        )


_NAMED = ("index", "names", "turns", "layouts")  # what tables with the same names have in common
_PRIORLESS = (*_NAMED, "_values", "usual", "bounds", "preferences", "_most")  # and where priors alone differ
_VALUELESS = (*_NAMED, "scales", "usual", "bounds", "priors", "believed", "preferences", "_most")  # and where values do


@dataclass(frozen=True)
class ParameterTable:
    """An ordered, immutable set of parameters with unique names; `together` are the priors that several of them share."""

    rows: tuple[Parameter, ...] = ()
    together: tuple[Together, ...] = ()

    def __post_init__(self) -> None:
        if len(self.index) != len(self.rows):
            double = next(p.name for i, p in enumerate(self.rows) if self.index[p.name] != i)
            raise ModelError("a parameter name is used twice", key=double)

    @cached_property
    def index(self) -> dict[str, int]:
        """Name to row number."""
        return {p.name: i for i, p in enumerate(self.rows)}

    @cached_property
    def names(self) -> tuple[str, ...]:
        """All names, in order."""
        return tuple([p.name for p in self.rows])

    @property
    def values(self) -> NDArray[np.float64]:
        """All values, shape (P,)."""
        return self._values.copy()

    @cached_property
    def _values(self) -> NDArray[np.float64]:
        return np.array([p.value for p in self.rows])

    @property
    def free(self) -> tuple[str, ...]:
        """The names that are to be identified."""
        return tuple(p.name for p in self.rows if p.free)

    @cached_property
    def turns(self) -> NDArray[np.int64]:
        """Row number of the first component of every rotation vector."""
        found, i = [], 0
        while i < len(self.rows):
            if self.rows[i].turn:
                found.append(i)
                i += 3
            else:
                i += 1
        return np.array(found, dtype=np.int64)

    @cached_property
    def layouts(self) -> dict[tuple[str, ...], Any]:
        """What problems have worked out of names and turns alone, by their free columns: the same for all tables with these names."""
        return {}

    @cached_property
    def scales(self) -> NDArray[np.float64]:
        """`Parameter.scale` of every row, (P,)."""
        return np.where(self.prior_informs, self.priors, self.usual)

    @cached_property
    def usual(self) -> NDArray[np.float64]:
        """`Parameter.usual` of every row, (P,)."""
        return np.array([p.usual for p in self.rows], dtype=float)

    @cached_property
    def bounds(self) -> NDArray[np.float64]:
        """Lower and upper bounds, (2, P)."""
        return np.array([[p.lower for p in self.rows], [p.upper for p in self.rows]])

    @cached_property
    def priors(self) -> NDArray[np.float64]:
        """`Parameter.prior` of every row, (P,); zero where none is stated."""
        return np.array([p.prior or 0.0 for p in self.rows])

    @cached_property
    def prior_informs(self) -> NDArray[np.bool_]:
        """`Parameter.believed` of every row, (P,)."""
        stated = np.array([p.prior is not None for p in self.rows], dtype=bool)
        return np.asarray(stated & (self.priors <= self._most))

    @cached_property
    def _most(self) -> NDArray[np.float64]:
        """How wide a prior may be that is believed, (P,)."""
        return np.asarray(np.maximum(self.usual, [WIDE * TYPICAL.get(p.unit, 1.0) for p in self.rows]))

    @cached_property
    def preferences(self) -> NDArray[np.int64]:
        """`Parameter.preference` of every row, (P,)."""
        return np.array([p.preference for p in self.rows], dtype=np.int64)

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, name: str) -> Parameter:
        if name not in self.index:
            raise ModelError("unknown parameter", key=name, suggestion=nearest(name, self.index))
        return self.rows[self.index[name]]

    def __contains__(self, name: object) -> bool:
        return name in self.index

    def __add__(self, other: ParameterTable | Iterable[Parameter]) -> ParameterTable:
        if isinstance(other, ParameterTable):
            return ParameterTable(self.rows + other.rows, self.together + other.together)
        return ParameterTable(self.rows + tuple(other), self.together)

    def with_values(self, values: Mapping[str, float] | NDArray[np.float64]) -> ParameterTable:
        """The same table with other values: by name, or an array of shape (P,)."""
        if isinstance(values, Mapping):
            for name in values:
                _ = self[name]
            rows = [_replace(p, value=float(values[p.name])) if p.name in values else p for p in self.rows]
            return self._of(rows, same=_VALUELESS)
        each = np.asarray(values, float).tolist()
        return self._of([_replace(p, value=v) for p, v in zip(self.rows, each, strict=True)], same=_VALUELESS)

    def with_free(self, names: Iterable[str]) -> ParameterTable:
        """The same table with exactly these names free."""
        wanted = set(names)
        for name in wanted:
            _ = self[name]
        return self._of([p if p.free == (p.name in wanted) else _replace(p, free=not p.free) for p in self.rows])

    def with_priors(self, priors: Mapping[str, float | None]) -> ParameterTable:
        """The same table with these prior standard deviations; what was said of these names before is gone, together with
        others or alone."""
        for name in priors:
            _ = self[name]
        rows = [_replace(p, prior=priors[p.name]) if p.name in priors else p for p in self.rows]
        left = (t.without(priors) for t in self.together)
        return self._of(rows, tuple(t for t in left if len(t.names) > 1), same=_PRIORLESS)

    def with_covariance(self, names: Sequence[str], covariance: ArrayLike) -> ParameterTable:
        """The same table with a prior of several parameters together, covariance (k, k) in SI.

        Raises ModelError for an unknown name or one given twice, and for a matrix that is no covariance of so many: not
        (k, k), not finite, not symmetric, not positive definite.
        """
        names, c = tuple(names), np.asarray(covariance, float)
        if len(set(names)) < len(names):
            double = next(n for i, n in enumerate(names) if n in names[:i])
            raise ModelError("a prior names a parameter twice", key=double)
        check_covariance(c, len(names), ", ".join(names[:3]) + (" ..." if len(names) > 3 else ""))
        made = self.with_priors({n: float(s) for n, s in zip(names, np.sqrt(np.diag(c)), strict=True)})
        return ParameterTable(
            made.rows, (*made.together, _together(names, (c + c.T) / 2)) if len(names) > 1 else made.together
        )

    def with_preferences(self, preferences: Mapping[str, int]) -> ParameterTable:
        """The same table with these preferences."""
        for name in preferences:
            _ = self[name]
        return self._of([_replace(p, preference=preferences.get(p.name, p.preference)) for p in self.rows])

    def with_expected(self, expected: Mapping[str, float]) -> ParameterTable:
        """The same table with these errors expected where nobody states a prior, in the parameters' units."""
        for name in expected:
            _ = self[name]
        return self._of([_replace(p, expected=expected.get(p.name, p.expected)) for p in self.rows])

    def _of(
        self, rows: Sequence[Parameter], together: tuple[Together, ...] | None = None, same: tuple[str, ...] = _NAMED
    ) -> ParameterTable:
        """A table of rows with the same names and turns: what is known of these, `same`, need not be found again."""
        _ = self.layouts
        made, known = object.__new__(ParameterTable), self.__dict__
        made.__dict__.update({k: known[k] for k in same if k in known})
        made.__dict__.update(rows=tuple(rows), together=self.together if together is None else together)
        return made

    def match(self, patterns: Iterable[str]) -> tuple[str, ...]:
        """Names selected by full names (`j2.alpha`), symbols (`alpha`) or owners (`tool`); errors name the nearest."""
        chosen: set[str] = set()
        for pattern in patterns:
            hits = [n for n in self.index if pattern in (n, n.rpartition(".")[0], n.rpartition(".")[2])]
            if not hits:
                known = {w for n in self.index for w in (n, n.rpartition(".")[0], n.rpartition(".")[2])}
                raise ModelError("no parameter has this name", key=pattern, suggestion=nearest(pattern, known))
            chosen.update(hits)
        return tuple(n for n in self.index if n in chosen)
