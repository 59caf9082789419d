"""How long work tells its progress: it calls a watcher with an event of every step; one that raises errors.Cancelled stops it."""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["Watch", "tell"]

Watch = Callable[[dict[str, object]], None]


def tell(watch: Watch | None, stage: str, **facts: object) -> None:
    """Tells a watcher, where there is one, of a step of this stage."""
    if watch:
        watch({"stage": stage, **facts})
