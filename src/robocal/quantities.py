"""What a number of a result is, said beside it, so that one dataclass holds it in SI and as a document shows it.

    @dataclass(frozen=True)
    class Stages:
        unit: ShownUnit          # "m" in SI, "mm" in a document: the unit in force here and in whatever is below
        mean: Amount             # in that unit

`files.shown` converts whole trees. A number that a document lacks (null) is NaN where a class says `Amount`, and None where it says
`Amount | None`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, TypeAlias

__all__ = [
    "AMOUNT",
    "MEAN",
    "OWN",
    "SHOWN",
    "VALUE",
    "Amount",
    "Mark",
    "Mean",
    "OwnUnit",
    "Share",
    "ShownUnit",
    "Value",
]


@dataclass(frozen=True)
class Mark:
    """What the field of a dataclass is."""

    what: str

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """For whoever reads a document: numbers may be null there, and are NaN then."""
        if source is not float:
            return handler(source)
        number = {"type": "nullable", "schema": handler(source)}
        return {"type": "function-after", "function": {"type": "no-info", "function": _known}, "schema": number}


def _known(value: float | None) -> float:
    return math.nan if value is None else value


AMOUNT, VALUE, MEAN, SHARE = (
    Mark(w) for w in ("a size or a difference", "a value", "the mean of a statistic", "a ratio")
)
SHOWN, OWN = Mark("the unit in which errors are shown: mm, deg, px"), Mark("the unit in which the robot's file speaks")

Amount: TypeAlias = Annotated[float, AMOUNT]  # of the unit in force, without its offset (a difference of temperatures)
Value: TypeAlias = Annotated[float, VALUE]  # of the unit in force, with its offset (a temperature)
Mean: TypeAlias = Annotated[float, MEAN]  # an amount, of which SI holds the whole statistic
Share: TypeAlias = Annotated[float, SHARE]  # without a unit
ShownUnit: TypeAlias = Annotated[str, SHOWN]
OwnUnit: TypeAlias = Annotated[str, OWN]
