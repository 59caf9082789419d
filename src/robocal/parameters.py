"""The table of named parameters: what a machine is made of, one row per number.

A name reads `owner.symbol` (`j2.alpha`, `tool.x`, `tracker.rz`). Values are SI and radians. Three consecutive rows
whose `turn` is true are one rotation vector: they are stepped on the group, R <- exp(w) R, never by adding components.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robocal.errors import ModelError, nearest

__all__ = ["FRAME_SYMBOLS", "Parameter", "Table", "frame_parameters"]

FRAME_SYMBOLS = ("x", "y", "z", "rx", "ry", "rz")

# What a parameter is expected to be off by when nobody states a prior: typical of a factory-built arm.
TYPICAL = {"m": 1e-3, "rad": 5e-3, "1": 1e-3}


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
        """The error expected without data, in the parameter's unit."""
        if self.prior is not None:
            return self.prior
        return self.expected if self.expected is not None else TYPICAL.get(self.unit, 1.0)


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
            Parameter(
                f"{owner}.{symbol}",
                float(value[i]),
                unit,
                frees[i],
                turn=i >= 3,
                expected=scale,
                source=source,
            )
        )
    return tuple(rows)


@dataclass(frozen=True)
class Table:
    """An ordered, immutable set of parameters with unique names."""

    rows: tuple[Parameter, ...] = ()

    def __post_init__(self) -> None:
        if len(self.index) != len(self.rows):
            double = next(p.name for i, p in enumerate(self.rows) if self.index[p.name] != i)
            raise ModelError("a parameter name is used twice", key=double)

    @cached_property
    def index(self) -> dict[str, int]:
        """Name to row number."""
        return {p.name: i for i, p in enumerate(self.rows)}

    @property
    def names(self) -> tuple[str, ...]:
        """All names, in order."""
        return tuple(p.name for p in self.rows)

    @property
    def values(self) -> NDArray[np.float64]:
        """All values, shape (P,)."""
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

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, name: str) -> Parameter:
        if name not in self.index:
            raise ModelError("unknown parameter", key=name, suggestion=nearest(name, self.index))
        return self.rows[self.index[name]]

    def __contains__(self, name: object) -> bool:
        return name in self.index

    def __add__(self, other: Table | Iterable[Parameter]) -> Table:
        rows = other.rows if isinstance(other, Table) else tuple(other)
        return Table(self.rows + rows)

    def with_values(self, values: Mapping[str, float] | NDArray[np.float64]) -> Table:
        """The same table with other values: by name, or an array of shape (P,)."""
        if isinstance(values, Mapping):
            for name in values:
                _ = self[name]
            return Table(tuple(replace(p, value=float(values.get(p.name, p.value))) for p in self.rows))
        return Table(tuple(replace(p, value=float(v)) for p, v in zip(self.rows, values, strict=True)))

    def with_free(self, names: Iterable[str]) -> Table:
        """The same table with exactly these names free."""
        wanted = set(names)
        for name in wanted:
            _ = self[name]
        return Table(tuple(replace(p, free=p.name in wanted) for p in self.rows))

    def with_priors(self, priors: Mapping[str, float | None]) -> Table:
        """The same table with these prior standard deviations."""
        for name in priors:
            _ = self[name]
        return Table(tuple(replace(p, prior=priors[p.name]) if p.name in priors else p for p in self.rows))

    def with_preferences(self, preferences: Mapping[str, int]) -> Table:
        """The same table with these preferences."""
        for name in preferences:
            _ = self[name]
        return Table(tuple(replace(p, preference=preferences.get(p.name, p.preference)) for p in self.rows))

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
