"""The verb `cable workspace`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from robocal.cli.guard import DONE, UNTRUSTED
from robocal.cli.terminal import Terminal, command_line

__all__ = ["workspace"]


def workspace(*, robot: str, output: str | None, json: bool, **options: Any) -> int:
    """cable workspace: a summary, and files in a folder; 3 when nothing can be held."""
    terminal = Terminal(json=json)
    with terminal.watching() as watch:
        from robocal.jobs.cable.workspace import cable_workspace as job

        folder = None if output is None else Path(output)
        made = job(robot, output=folder, command=command_line(), watch=watch, **options)
    for warning in (*made.warnings, *made.doubts):
        terminal.warn(warning)
    terminal.document({**made.document, "written": [str(p) for p in made.written]})
    if not json:
        from robocal.cli.show_cable_workspace import show_workspace

        show_workspace(terminal, made)
    return UNTRUSTED if made.doubts else DONE
