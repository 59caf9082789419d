"""In which unit a page tells where things are: that of the robot's file."""

from __future__ import annotations

from collections.abc import Iterable
from math import ceil, log10

from robocal._record import record
from robocal.report.numbers import significant, with_decimals
from robocal.report.svg import tick_text

__all__ = ["METRE", "LengthUnit"]


@record
class LengthUnit:
    """A unit of length: its name, and how many metres it is. Areas and volumes are given in m² and m³."""

    name: str = "m"
    metres: float = 1.0

    def title(self, letter: str) -> str:
        """Of an axis."""
        return f"{letter}, {self.name}"

    def text(self, value: float, finest: int = 3) -> str:
        """A length in m, in this unit and without its name, to so many decimals of a metre."""
        return with_decimals(value / self.metres, max(0, finest - ceil(-log10(self.metres) - 1e-9)))

    def short(self, value: float) -> str:
        """A length in m to a few digits, in this unit with its name."""
        return f"{significant(value / self.metres)} {self.name}"

    def tick(self, value: float) -> str:
        """The same as a tick's number."""
        return tick_text(round(value / self.metres, 12))

    def point(self, at: Iterable[float]) -> str:
        """A place (3,) m."""
        return "(" + ", ".join(self.text(float(v)) for v in at) + f") {self.name}"


METRE = LengthUnit()
