"""The part of joint space in which a correction should hold."""

from __future__ import annotations

from dataclasses import dataclass

from robocal._types import Array

__all__ = ["JointRegion"]


@dataclass(frozen=True, eq=False)
class JointRegion:
    """Joint configurations (m, n) that stand for a part of joint space, and its name."""

    joints: Array
    name: str
