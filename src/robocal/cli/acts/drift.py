"""The verb `drift`: has a robot changed between two calibrations?"""

from __future__ import annotations

from pathlib import Path

from robocal.cli.guard import DONE, UNTRUSTED
from robocal.cli.terminal import Terminal, command_line

__all__ = ["drift"]


def drift(*, first: str, second: str, new_tool: bool, matters: str, output: str | None, json: bool) -> int:
    """drift: 0 when the runs could be compared, whatever came of it; 3 when nothing follows from them."""
    terminal = Terminal(json=json)
    with terminal.watching() as watch:
        from robocal.files.units import parse_quantity
        from robocal.jobs.drift import drift as job

        folder = None if output is None else Path(output)
        least = parse_quantity(matters, "m", key="--matters")
        found = job(
            Path(first),
            Path(second),
            new_tool=new_tool,
            matters=least,
            output=folder,
            command=command_line(),
            watch=watch,
        )
    from robocal.cli.show_trust import show_drift

    terminal.document(found.document)
    show_drift(terminal, found)
    return UNTRUSTED if found.void else DONE
