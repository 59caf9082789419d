"""How long work tells its progress: it calls a watcher with an event of every step; one that raises errors.Cancelled stops it.

Who wants to hear that kernels are compiled says so here: what compiles is loaded only where something is computed.
"""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["Watch", "on_compile", "tell", "tell_of_compilation"]

Watch = Callable[[dict[str, object]], None]


def tell(watch: Watch | None, stage: str, **facts: object) -> None:
    """Tells a watcher, where there is one, of a step of this stage."""
    if watch:
        watch({"stage": stage, **facts})


_told: list[Callable[[str], object]] = []


def on_compile(callback: Callable[[str], object] | None) -> None:
    """Call `callback` once, just before a kernel is really compiled (not when it is cached), with its name, as "geometry.add_step";
    None calls nobody."""
    _told[:] = [] if callback is None else [callback]


def tell_of_compilation(kernel: str) -> None:
    """Tells whoever asked for it, once, that a kernel is compiled now."""
    if _told:
        _told.pop()(kernel)
