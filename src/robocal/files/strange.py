"""Rows that do not belong to the others, as result.json tells them."""

from __future__ import annotations

from dataclasses import dataclass, field

from robocal.files.parts import Number, Remark

__all__ = ["Outlier"]


@dataclass(frozen=True, kw_only=True)
class Outlier:
    """A row that does not belong to the others: its value (mm, deg, px), distance in robust standard deviations from a fit
    without it, corrected for its leverage; p_value is the chance that the farthest of all rows would be, without any outlier.
    set_aside: not fitted; counted: the verdict counts its error, of a row that was set aside where one of the two models comes near
    it."""

    configuration: str
    group: str
    kind: str
    target: str = ""
    source: str = ""
    row: int | None = None
    distance: Number
    p_value: Number
    leverage: Number = None
    value: list[Number] = field(default_factory=list)
    units: list[str] = field(default_factory=list)
    set_aside: bool = False
    counted: bool = False
    cause: Remark | None = None
