"""Driven axes of a path, and where they count from."""

from __future__ import annotations

import math
from dataclasses import dataclass

__all__ = ["Joint", "Zero"]


@dataclass(frozen=True)
class Joint:
    """A driven axis: its column phi is called `name`; limits in rad or m."""

    name: str
    type: str = "revolute"
    lower: float = -math.inf
    upper: float = math.inf


@dataclass(frozen=True)
class Zero:
    """A joint, the parameter that shifts where it counts from, and the change of that parameter per offset of the joint."""

    joint: str
    parameter: str
    factor: float
