"""The verb `cable forward`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from robocal.cli.guard import DONE, UNTRUSTED
from robocal.cli.terminal import Terminal, command_line

__all__ = ["forward"]


def forward(*, robot: str, lengths: str, output: str | None, json: bool, **options: Any) -> int:
    """cable forward: the CSV on stdout, or a file; doubts on stderr."""
    terminal = Terminal(json=json)
    with terminal.watching():
        from robocal.jobs.cable.forward import cable_forward as job

        place = None if output is None else Path(output)
        made = job(robot, lengths, output=place, command=command_line(), **options)
    for warning in (*made.warnings, *made.doubts):
        terminal.warn(warning)
    terminal.document({**made.document, "written": None if made.written is None else str(made.written)})
    if not json:
        sys.stdout.write(made.text if made.written is None else f"{made.written}\n")
    return UNTRUSTED if made.doubts else DONE
