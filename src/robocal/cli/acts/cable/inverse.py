"""The verb `cable inverse`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from robocal.cli.guard import DONE
from robocal.cli.terminal import Terminal, command_line

__all__ = ["inverse"]


def inverse(*, robot: str, poses: str, output: str | None, json: bool, **options: Any) -> int:
    """cable inverse: the CSV on stdout, or a file."""
    terminal = Terminal(json=json)
    from robocal.jobs.cable.inverse import cable_inverse as job

    made = job(robot, poses, output=None if output is None else Path(output), command=command_line(), **options)
    for warning in made.warnings:
        terminal.warn(warning)
    terminal.document({**made.document, "written": None if made.written is None else str(made.written)})
    if not json:
        sys.stdout.write(made.text if made.written is None else f"{made.written}\n")
    return DONE
