"""The table of named parameters: what a machine is made of, one row per number.

A name reads `owner.symbol` (`j2.alpha`, `tool.x`, `tracker.rz`). Values are SI and radians. Three consecutive rows
whose `turn` is true are one rotation vector: they are stepped on the group, R <- exp(w) R, never by adding components.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robocal._record import cached_property, record
from robocal.errors import ModelError, nearest, require

__all__ = ["FRAME_SYMBOLS", "Parameter", "ParameterTable", "Together", "check_covariance", "frame_parameters"]

FRAME_SYMBOLS = ("x", "y", "z", "rx", "ry", "rz")

# What a parameter is expected to be off by when nobody states a prior: typical of a factory-built arm.
TYPICAL = {"m": 1e-3, "rad": 5e-3, "1": 1e-3}
WIDE = 1e3  # a metre, any angle: so far off, nothing is known
ROUNDING = 1e-13


@record
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


@record
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
    prior: Sequence[float] | None = None,
    source: str = "",
) -> tuple[Parameter, ...]:
    """The six rows (x, y, z, rx, ry, rz) of a frame: translation in m, rotation vector in rad, shape of `value`
    (6,); `prior` (6,) are standard deviations around them."""
    frees = (free,) * 6 if isinstance(free, bool) else tuple(free)
    scales, rows = (None, None) if expected is None else expected, []
    for i, symbol in enumerate(FRAME_SYMBOLS):
        unit, scale, name = ("m", "rad")[i // 3], scales[i // 3], f"{owner}.{symbol}"
        own = None if prior is None else float(prior[i])
        rows.append(Parameter(name, float(value[i]), unit, frees[i], own, turn=i >= 3, expected=scale, source=source))
    return tuple(rows)


# How unequal the two halves of a covariance may be, relative to its standard deviations: what writing it down leaves.
SYMMETRIC = 1e-6


def check_covariance(c: NDArray[np.float64], size: int, key: str) -> None:
    """Raises ModelError where c (..., size, size) is no covariance; `key` says whose prior it is."""
    square, expected = c.shape[-2:] == (size, size), f"{size} x {size}"
    require(square, "a prior's covariance has another size", key=key, found=c.shape, expected=expected)
    require(np.isfinite(c).all(), "a prior's covariance must be finite", key=key)
    own = np.diagonal(c, axis1=-2, axis2=-1)
    least = float(own.min(initial=np.inf))
    require(least > 0, "a prior's variances must be above zero", key=key, found=least)
    unit = c / np.sqrt(own[..., :, None] * own[..., None, :])
    symmetric = (np.abs(unit - np.swapaxes(unit, -1, -2)) <= SYMMETRIC).all()
    require(symmetric, "a prior's covariance must be symmetric", key=key)
    # Units differ by orders of magnitude, so it is the correlations whose eigenvalues say whether it is one.
    least = float(np.linalg.eigvalsh(unit).min(initial=np.inf))
    found = f"smallest eigenvalue of the correlations {least:.3g}"
    expected = "above 0; parameters that depend on each other exactly cannot have priors of their own"
    message = "a prior's covariance must be positive definite"
    require(least > ROUNDING, message, key=key, found=found, expected=expected)


_NAMED = ("index", "names", "turns", "layouts")  # what tables with the same names have in common
_PRIORLESS = (*_NAMED, "_values", "usual", "bounds", "preferences", "_most")  # and where priors alone differ
_VALUELESS = (*_NAMED, "scales", "usual", "bounds", "priors", "believed", "preferences", "_most")  # and where values do


@record
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
        # A run of rows that turn is one rotation vector after the other.
        found: list[int] = []
        for i, p in enumerate(self.rows):
            if p.turn and (not found or i >= found[-1] + 3):
                found.append(i)
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
        more, together = (other.rows, other.together) if isinstance(other, ParameterTable) else (tuple(other), ())
        return ParameterTable(self.rows + more, self.together + together)

    def with_values(self, values: Mapping[str, float] | NDArray[np.float64]) -> ParameterTable:
        """The same table with other values: by name, or an array of shape (P,)."""
        if isinstance(values, Mapping):
            return self._of(self._change("value", {n: float(v) for n, v in values.items()}), same=_VALUELESS)
        each = zip(self.rows, np.asarray(values, float).tolist(), strict=True)
        return self._of([p if p.value == v else _replace(p, value=v) for p, v in each], same=_VALUELESS)

    def with_free(self, names: Iterable[str]) -> ParameterTable:
        """The same table with exactly these names free."""
        wanted = set(names)
        for name in wanted:
            _ = self[name]
        return self._of([p if p.free == (p.name in wanted) else _replace(p, free=not p.free) for p in self.rows])

    def with_priors(self, priors: Mapping[str, float | None]) -> ParameterTable:
        """The same table with these prior standard deviations; what was said of these names before is gone, together with
        others or alone."""
        rows = self._change("prior", priors)
        left = (t.without(priors) for t in self.together)
        return self._of(rows, tuple(t for t in left if len(t.names) > 1), same=_PRIORLESS)

    def with_covariance(self, names: Sequence[str], covariance: ArrayLike) -> ParameterTable:
        """The same table with a prior of several parameters together, covariance (k, k) in SI.

        Raises ModelError for an unknown name or one given twice, and for a matrix that is no covariance of so many: not
        (k, k), not finite, not symmetric, not positive definite.
        """
        names, c = tuple(names), np.asarray(covariance, float)
        double = next((n for i, n in enumerate(names) if n in names[:i]), None)
        require(double is None, "a prior names a parameter twice", key=double)
        check_covariance(c, len(names), ", ".join(names[:3]) + (" ..." if len(names) > 3 else ""))
        made = self.with_priors({n: float(s) for n, s in zip(names, np.sqrt(np.diag(c)), strict=True)})
        more = (_together(names, (c + c.T) / 2),) if len(names) > 1 else ()
        return ParameterTable(made.rows, made.together + more)

    def with_preferences(self, preferences: Mapping[str, int]) -> ParameterTable:
        """The same table with these preferences."""
        return self._of(self._change("preference", preferences))

    def with_expected(self, expected: Mapping[str, float]) -> ParameterTable:
        """The same table with these errors expected where nobody states a prior, in the parameters' units."""
        return self._of(self._change("expected", expected))

    def _change(self, what: str, values: Mapping[str, float | None]) -> list[Parameter]:
        """The rows with another number in one field. Raises ModelError for an unknown name."""
        for name in values:
            _ = self[name]
        return [_replace(p, **{what: values[p.name]}) if p.name in values else p for p in self.rows]

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
        known = {n: {n, n.rpartition(".")[0], n.rpartition(".")[2]} for n in self.index}
        every, wanted = {w for words in known.values() for w in words}, tuple(patterns)
        for pattern in wanted:
            if pattern not in every:
                raise ModelError("no parameter has this name", key=pattern, suggestion=nearest(pattern, every))
        return tuple(n for n, words in known.items() if not words.isdisjoint(wanted))
