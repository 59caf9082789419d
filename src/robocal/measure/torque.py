"""The torque (N m) that a drive asks of its motor; see `effort`."""

from __future__ import annotations

from robocal.measure.effort import effort_kind
from robocal.measure.rows import register

__all__ = ["TORQUE"]

TORQUE = register(effort_kind("torque", "N m"))
