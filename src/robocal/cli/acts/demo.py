"""The verb `demo`: three arms being calibrated."""

from __future__ import annotations

from pathlib import Path

from robocal.cli.guard import DONE, UNTRUSTED
from robocal.cli.terminal import Terminal

__all__ = ["demo"]


def demo(*, name: str | None, output: str, seed: int, json: bool) -> int:
    """demo: 0 when every case came out as it should."""
    from robocal.cli.show_demo import show_demo

    return DONE if show_demo(Terminal(json=json), name, Path(output), seed) else UNTRUSTED
