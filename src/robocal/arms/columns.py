"""Columns that are computed from a configuration: what a chain's terms may multiply besides joint values and recorded
numbers.

A column is plain frozen data that answers `columns(q, known)`: arrays (m,) by name, from joint values q (m, n) and
what is known so far. What depends on the geometry too (moments of gravity, lengths that grow) is *lagged*: taken at
the values that the chain had, constant while parameters are sought, and taken anew by `Chain.with_values`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.parameters import ParameterTable

__all__ = ["ChainColumn", "Growth", "Harmonic", "Recorded"]

Known = Mapping[str, Array]
FADE = 0.1  # rad


class ChainColumn(Protocol):
    """Something that gives named columns."""

    @property
    def names(self) -> tuple[str, ...]:
        """The columns that it gives."""

    def columns(self, q: Array, known: Known) -> dict[str, Array]:
        """Values (m,) by name, for joint values q (m, n) and the columns that are known."""

    def at(self, table: ParameterTable) -> ChainColumn:
        """The same at other parameter values; most know none."""
        return self


@record
class Harmonic(ChainColumn):
    """cos(k q_j) and sin(k q_j): what an eccentric gear adds to the joint that it drives; k need not be whole.

    Outside low .. high (rad) they fade to zero over FADE: many orders that were found over part of a turn say nothing
    of the rest of it, and together they would say it loudly.
    """

    joint: str
    order: float
    low: float = -np.inf
    high: float = np.inf

    @property
    def names(self) -> tuple[str, ...]:
        return (f"cos({self.order:g} {self.joint})", f"sin({self.order:g} {self.joint})")

    def columns(self, q: Array, known: Known) -> dict[str, Array]:
        q_j = known[self.joint]
        waves = np.cos(self.order * q_j), np.sin(self.order * q_j)
        if np.isinf(self.low) and np.isinf(self.high):
            return dict(zip(self.names, waves, strict=True))
        outside = np.maximum(np.maximum(self.low - q_j, q_j - self.high), 0.0)
        inside = np.maximum(1.0 - outside / FADE, 0.0)
        return {name: inside * wave for name, wave in zip(self.names, waves, strict=True)}


@record
class Recorded(ChainColumn):
    """A recorded column minus its reference (temperature, sign of approach); zero where nothing was recorded, so that a
    model with it can be asked anywhere."""

    source: str
    reference: float = 0.0

    @property
    def names(self) -> tuple[str, ...]:
        return (f"{self.source} - {self.reference:g}",)

    def columns(self, q: Array, known: Known) -> dict[str, Array]:
        found = known.get(self.source)
        return {self.names[0]: np.zeros(len(q)) if found is None else found - self.reference}


@record
class Growth:
    """A length (m) times the temperature above the reference (K); zero where no temperature was recorded.

    The length is `constant` plus the parameters named in `terms`, each times its factor.
    """

    label: str
    length: float
    reference: float
    terms: tuple[tuple[str, float], ...] = ()
    constant: float = 0.0

    @property
    def names(self) -> tuple[str, ...]:
        return (f"growth of {self.label}",)

    def columns(self, q: Array, known: Known) -> dict[str, Array]:
        found = known.get("temperature")
        return {self.names[0]: np.zeros(len(q)) if found is None else self.length * (found - self.reference)}

    def at(self, table: ParameterTable) -> ChainColumn:
        return replace(self, length=self.constant + sum(f * table[name].value for name, f in self.terms))
