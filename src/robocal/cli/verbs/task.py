"""What a verb hands back: a call that is made once the command line is known to be right."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

__all__ = ["Task", "task"]

Task = Callable[[], int]


def task(verb: str, options: dict[str, Any]) -> Task:
    """The act of this verb ("plan", "cable.poses") with its options, loaded when it is called."""
    return lambda: int(getattr(import_module(f"robocal.cli.acts.{verb}"), verb.rpartition(".")[2])(**options))
