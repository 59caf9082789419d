"""Columns that are computed from a configuration: what a chain's terms may multiply besides joint values and recorded
numbers.

A column is plain frozen data that answers `columns(q, known)`: arrays (m,) by name, from joint values q (m, n) and
what is known so far. None depends on the parameters that are being identified, so they are computed once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = ["Column", "Harmonic", "Recorded"]

Array = NDArray[np.float64]
Known = Mapping[str, Array]


class Column(Protocol):
    """Something that gives named columns."""

    @property
    def names(self) -> tuple[str, ...]:
        """The columns that it gives."""

    def columns(self, q: Array, known: Known) -> dict[str, Array]:
        """Values (m,) by name, for joint values q (m, n) and the columns that are known."""


@dataclass(frozen=True)
class Harmonic:
    """cos(k q_j) and sin(k q_j): what an eccentric gear adds to the joint that it drives; k need not be whole."""

    joint: str
    order: float

    @property
    def names(self) -> tuple[str, ...]:
        return (f"cos({self.order:g} {self.joint})", f"sin({self.order:g} {self.joint})")

    def columns(self, q: Array, known: Known) -> dict[str, Array]:
        angle = self.order * known[self.joint]
        return dict(zip(self.names, (np.cos(angle), np.sin(angle)), strict=True))


@dataclass(frozen=True)
class Recorded:
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
