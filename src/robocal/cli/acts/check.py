"""The verb `check`: what files contain and can tell."""

from __future__ import annotations

from collections.abc import Sequence

from robocal.cli.guard import DONE
from robocal.cli.terminal import Terminal

__all__ = ["check"]


def check(
    *, robot: str, data: Sequence[str] | None, exclude: Sequence[str], base: str | None, tip: str | None, json: bool
) -> int:
    """check: 0 when the files are right, whatever they can tell."""
    terminal = Terminal(json=json)
    with terminal.watching() as watch:
        from robocal.jobs.check import check as job

        found = job(robot, data or (), base=base, tip=tip, exclude=exclude, watch=watch)
    from robocal.cli.show_more import show_check

    terminal.document(found.document)
    show_check(terminal, found)
    return DONE
