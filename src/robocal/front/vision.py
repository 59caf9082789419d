"""Cameras and printed sheets: every verb of `robocal vision` as a function of files, `rc.camera.detect("images", size=48)`."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from robocal.verbs.registry import VISION

__all__ = [*VISION]


def __getattr__(name: str) -> Any:
    if name in VISION:
        return import_module("robocal.front.calls").call(f"vision.{name}")
    raise AttributeError(f"robocal.camera has no {name!r}; it has {', '.join(VISION)}")


def __dir__() -> list[str]:
    return __all__
