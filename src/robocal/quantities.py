"""What a number of a result is, said beside it, so that one dataclass holds it in SI and as a document shows it.

    @record
    class Stages:
        unit: DisplayUnit        # "m" in SI, "mm" in a document: the unit in force here and in whatever is below
        mean: Amount             # in that unit

`files.display` converts whole trees. A number that a document lacks (null) is NaN where a class says `Amount`, and None where it says
`Amount | None`.

Numbers of several units in one place carry theirs one by one: a `UnitValue`, or the columns of a `Listing`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Protocol, TypeAlias

from robocal._record import field, record, replace

__all__ = [
    "AMOUNT",
    "DISPLAY",
    "LARGEST",
    "MEAN",
    "OWN",
    "VALUE",
    "Amount",
    "Column",
    "DisplayUnit",
    "Listing",
    "Mean",
    "OwnUnit",
    "QuantityKind",
    "Share",
    "UnitValue",
    "Value",
    "unit_value",
]

LARGEST = 1e30  # of what files say, in any unit; products of such numbers still are numbers


@record
class QuantityKind:
    """What the field of a dataclass is."""

    what: str

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """For whoever reads a document: numbers may be null there, and are NaN then."""
        if source is not float:
            return handler(source)
        number = {"type": "nullable", "schema": handler(source)}
        return {"type": "function-after", "function": {"type": "no-info", "function": _or_nan}, "schema": number}


@record
class AnyValues:
    """For whoever reads a document: a list of whatever stands in it."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        return {"type": "list"}


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


AMOUNT = QuantityKind("a size or a difference")
VALUE = QuantityKind("a value")
MEAN = QuantityKind("the mean of a statistic")
SHARE = QuantityKind("a ratio")
DISPLAY = QuantityKind("the unit in which errors are shown: mm, deg, px")
OWN = QuantityKind("the unit in which the robot's file speaks")

Amount: TypeAlias = Annotated[float, AMOUNT]  # of the unit in force, without its offset (a difference of temperatures)
Value: TypeAlias = Annotated[float, VALUE]  # of the unit in force, with its offset (a temperature)
Mean: TypeAlias = Annotated[float, MEAN]  # an amount, of which SI holds the whole statistic
Share: TypeAlias = Annotated[float, SHARE]  # without a unit
DisplayUnit: TypeAlias = Annotated[str, DISPLAY]
OwnUnit: TypeAlias = Annotated[str, OWN]

LAYOUT: Mapping[str, Any] = {"document": False}  # of a field that says how a number is laid out, and is in no document


@record
class UnitValue:
    """A number, or an array of numbers, and the unit that it is in."""

    value: Any
    unit: str


def unit_value(value: Any, unit: str) -> UnitValue | None:
    """The same of what may not be known."""
    return None if value is None else UnitValue(value, unit)


class ColumnValues(Protocol):
    """One value per row: a list, a tuple or an array."""

    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[Any]: ...
    def __getitem__(self, row: int, /) -> Any: ...


@record(eq=False)
class Column:
    """A column of a listing: its name, the unit of its values (empty where they have none), and a value for each row: a number, a word,
    an array. None or NaN: there is none.

    A CSV has `digits` significant ones, at most `decimals` after the point, `si_decimals` before the unit is changed. A table says `label`
    instead of name and unit, and formats as `spec` says, else with `figures` significant digits; `to` joins the ends of a range.
    """

    name: str
    unit: str
    values: Annotated[ColumnValues, AnyValues()]
    digits: int = field(default=15, metadata=LAYOUT)
    decimals: int | None = field(default=None, metadata=LAYOUT)
    si_decimals: int | None = field(default=None, metadata=LAYOUT)
    label: str = field(default="", metadata=LAYOUT)
    spec: str = field(default="", metadata=LAYOUT)
    figures: int = field(default=4, metadata=LAYOUT)

    @property
    def header(self) -> str:
        """Name and unit, as the header of a CSV: x [mm]."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def plain(self) -> list[Any]:
        """The values as Python's own."""
        values: Any = self.values
        return list(values.tolist() if hasattr(values, "tolist") else values)


@record(eq=False)
class Listing:
    """What a verb lists, one row for each pose, cable, target: the CSV (`files.display`), the document, the table on the terminal, on a
    page and in a notebook (`report.sections.listing_table`) are made from it."""

    columns: tuple[Column, ...]

    def __len__(self) -> int:
        return len(self.columns[0].values) if self.columns else 0

    def __getitem__(self, name: str) -> Column:
        return next(c for c in self.columns if c.name == name)

    @property
    def rows(self) -> Iterator[dict[str, Any]]:
        """Every row by the names of its columns."""
        names = [c.name for c in self.columns]
        return (dict(zip(names, row, strict=True)) for row in zip(*(c.plain for c in self.columns), strict=True))

    def only(self, *names: str) -> Listing:
        """The same with these columns, in this order."""
        return Listing(tuple(self[name] for name in names))

    def without(self, *names: str) -> Listing:
        """The same without these columns."""
        return Listing(tuple(c for c in self.columns if c.name not in names))

    def take(self, rows: Sequence[int]) -> Listing:
        """The same with these rows alone."""
        return Listing(tuple(replace(c, values=[c.values[i] for i in rows]) for c in self.columns))
