"""What models without a place have in common: a motor, a rope. They are their table of parameters, and nothing of them moves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeVar, cast

from robocal._record import replace
from robocal.parameters import ParameterTable

__all__ = ["Placeless"]

P = TypeVar("P")


class Placeless:
    """A record with a `table`, whose parameters have their own names alone."""

    table: ParameterTable

    @property
    def mechanism(self) -> None:
        """Nothing of it has a place."""
        return

    def part(self, kind: type[P], /) -> P | None:
        """Itself, where it is of this kind."""
        return self if isinstance(self, kind) else None

    def row(self, name: str, /) -> str:
        """The parameter that stands for a name: its own."""
        return name

    def with_values(self, values: Mapping[str, float], /) -> Self:
        """The same model with other parameter values."""
        return self.with_table(self.table.with_values(values))

    def with_table(self, table: ParameterTable, /) -> Self:
        """The same model with another table of the same names."""
        return cast("Self", replace(cast("Any", self), table=table))

    @property
    def geometric(self) -> tuple[str, ...]:
        """What its making leaves: none is a length or an angle of a size that anybody knows before."""
        return ()

    @property
    def lengths(self) -> tuple[str, ...]:
        """Lengths that share a scale: it has none."""
        return ()

    @property
    def anywhere(self) -> frozenset[str]:
        """Parameters that may be anything: all of them."""
        return frozenset(self.table.names)
