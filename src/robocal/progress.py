"""How long work tells its progress: it calls a watcher with an event of every step; one that raises errors.Cancelled stops it."""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["Watch"]

Watch = Callable[[dict[str, object]], None]
