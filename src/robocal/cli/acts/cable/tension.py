"""The verb `cable tension`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from robocal.cli.guard import DONE, UNTRUSTED
from robocal.cli.terminal import Terminal, command_line

__all__ = ["tension"]


def tension(*, robot: str, poses: str, output: str | None, json: bool, **options: Any) -> int:
    """cable tension: the CSV on stdout, or files and a summary; 3 when a pose is not held."""
    terminal = Terminal(json=json)
    with terminal.watching():
        from robocal.jobs.cable.tension import cable_tension as job

        folder = None if output is None else Path(output)
        made = job(robot, poses, output=folder, command=command_line(), **options)
    for warning in (*made.warnings, *made.doubts):
        terminal.warn(warning)
    terminal.document({**made.document, "written": [str(p) for p in made.written]})
    if not json:
        if folder is None:
            sys.stdout.write(made.text)
        else:
            from robocal.cli.show_cable_tension import show_tension

            show_tension(terminal, made)
    return UNTRUSTED if made.doubts else DONE
