"""The verb `cable poses`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from robocal.cli.guard import DONE
from robocal.cli.terminal import Terminal, command_line

__all__ = ["poses"]


def poses(*, robot: str, output: str | None, json: bool, **options: Any) -> int:
    """cable poses: the CSV on stdout, or files and a summary."""
    terminal = Terminal(json=json)
    with terminal.watching() as watch:
        from robocal.jobs.cable.poses import cable_poses as job

        folder = None if output is None else Path(output)
        made = job(robot, output=folder, command=command_line(), watch=watch, **options)
    for warning in made.warnings:
        terminal.warn(warning)
    terminal.document({**made.document, "written": [str(p) for p in made.written]} if json else None)
    if not json:
        from robocal.cli.show_cable_poses import show_poses, summary

        if folder is None:
            sys.stdout.write(made.text)
            terminal.note(summary(made))
        else:
            show_poses(terminal, made)
    return DONE
