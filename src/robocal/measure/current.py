"""The current (A) that a drive asks of its motor; see `effort`."""

from __future__ import annotations

from robocal.measure.effort import effort_kind
from robocal.measure.rows import register

__all__ = ["CURRENT"]

CURRENT = register(effort_kind("current", "A"))
