"""The parts of result.json beyond geometry: groups that were tried, what the robot has, the residual layer."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from robocal.files.parts import Number
from robocal.quantities import Amount, ShownUnit

__all__ = ["Beyond", "Gain", "GroupTried", "LayerSummary"]


@dataclass(frozen=True, kw_only=True)
class Gain:
    """A mean reduction of the unseen error, with its paired bootstrap 95 % interval."""

    mean: Amount | None
    low: Amount | None
    high: Amount | None


@dataclass(frozen=True, kw_only=True)
class GroupTried:
    """A group beyond geometry that was asked for: what it gained on blocks of rows that were not used (before: the mean
    error without it), and why it entered or not (code: the same for machines); orders of ripple by joint."""

    name: str
    parameters: int
    entered: bool
    reason: str
    code: str = ""
    unit: ShownUnit = ""
    before: Amount | None = None
    gain: Gain | None = None
    orders: dict[str, list[float]] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Beyond:
    """A group that the identified robot has; options in SI."""

    name: str
    options: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class LayerSummary:
    """The residual layer: mean unseen error in mm without and with it, on blocks of rows that neither model nor layer had
    seen; coverage is the share of unseen components within its 95 % band."""

    used: bool
    reason: str
    code: str = ""
    unit: ShownUnit = "mm"
    before: Amount | None = None
    after: Amount | None = None
    gain: Gain | None = None
    n: int = 0
    points: int = 0
    coverage: Number = None
