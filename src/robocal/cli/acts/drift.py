"""The verb `drift`: has a robot changed between two calibrations?"""

from __future__ import annotations

from pathlib import Path

from robocal.cli.guard import DONE
from robocal.cli.terminal import Terminal, command_line

__all__ = ["drift"]


def drift(*, first: str, second: str, new_tool: bool, output: str | None, json: bool) -> int:
    """drift: 0 when it could be compared, whatever came of it."""
    terminal = Terminal(json=json)
    with terminal.watching() as watch:
        from robocal.jobs.drift import drift as job

        folder = None if output is None else Path(output)
        found = job(Path(first), Path(second), new_tool=new_tool, output=folder, command=command_line(), watch=watch)
    from robocal.cli.show_trust import show_drift

    terminal.document(found.document)
    show_drift(terminal, found)
    return DONE
