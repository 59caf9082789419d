"""Cable robots: `rc.cable.robot("robot.yaml")` for arrays, and every verb of `robocal cable` as a function of files."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from robocal.verbs.registry import CABLE

__all__ = [*CABLE, "CableArm", "robot"]  # noqa: F822


def __getattr__(name: str) -> Any:
    if name in CABLE:
        return import_module("robocal.front.calls").call(f"cable.{name}")
    if name in __all__:
        return getattr(import_module("robocal.front.cable_arrays"), name)
    raise AttributeError(f"robocal.cable has no {name!r}; it has {', '.join(__all__)}")


def __dir__() -> list[str]:
    return __all__
