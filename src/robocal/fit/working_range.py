"""The part of joint space in which a correction should hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["JointRegion"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class JointRegion:
    """Joint configurations (m, n) that stand for a part of joint space, and its name."""

    joints: Array
    name: str
