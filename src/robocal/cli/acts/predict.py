"""The verb `predict`: places of the tool with their bands."""

from __future__ import annotations

from pathlib import Path

from robocal.cli.guard import DONE
from robocal.cli.terminal import Terminal

__all__ = ["predict"]


def predict(*, folder: str, poses: str, absolute: bool, output: str | None, json: bool) -> int:
    """predict: the tool's pose at given joint values, and how far it may be off."""
    terminal = Terminal(json=json)
    with terminal.watching() as watch:
        from robocal.jobs.predict import predict_run as job

        target = None if output is None else Path(output)
        found = job(Path(folder), Path(poses), absolute=absolute, output=target, watch=watch)
    from robocal.cli.show_trust import show_prediction

    terminal.document(found.document)
    show_prediction(terminal, found)
    return DONE
