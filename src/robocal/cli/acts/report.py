"""The verb `report`: the page once more."""

from __future__ import annotations

from pathlib import Path

from robocal.cli.guard import DONE
from robocal.cli.terminal import Terminal

__all__ = ["report"]


def report(*, folder: str, output: str | None, json: bool) -> int:
    """report: the page of a run folder, once more."""
    terminal = Terminal(json=json)
    from robocal.jobs.report import report as job

    written = job(Path(folder), None if output is None else Path(output))
    terminal.document({"written": str(written)})
    terminal.say(str(written))
    return DONE
