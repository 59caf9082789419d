"""The verb `compensate`: corrected targets."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from robocal.cli.guard import DONE, UNTRUSTED
from robocal.cli.terminal import Terminal, command_line

__all__ = ["compensate"]


def compensate(*, output: str | None, json: bool, **options: Any) -> int:
    """compensate: a table on stdout, or files and a summary; 3 when no target is reached or the calibration was not
    proven."""
    terminal = Terminal(json=json)
    with terminal.watching() as watch:
        from robocal.jobs.compensate import compensate as job

        folder = None if output is None else Path(output)
        found = job(**options, output=folder, command=command_line(), watch=watch)
    for warning in found.warnings:
        terminal.warn(warning)
    terminal.document(found.document)
    if not json:
        if folder is None:
            sys.stdout.write(found.text)
        else:
            from robocal.cli.show_handing import show_compensation

            show_compensation(terminal, found)
    return DONE if found.trusted else UNTRUSTED
