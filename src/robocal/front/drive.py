"""Motors and their drives: every verb of `robocal drive` as a function of files, `rc.drive.identify("sweep.csv")`."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from robocal.verbs.registry import DRIVE

__all__ = [*DRIVE]


def __getattr__(name: str) -> Any:
    if name in DRIVE:
        return import_module("robocal.front.calls").call(f"drive.{name}")
    raise AttributeError(f"robocal.drive has no {name!r}; it has {', '.join(DRIVE)}")


def __dir__() -> list[str]:
    return __all__
