"""The verb `plan`: which poses to measure."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from robocal.cli.guard import DONE
from robocal.cli.terminal import Terminal

__all__ = ["plan"]


def plan(*, robot: str, output: str | None, task_box: str | None, json: bool, **options: Any) -> int:
    """plan: joint program and data file in a folder."""
    terminal = Terminal(json=json)
    with terminal.watching() as watch:
        from robocal.jobs.plan import plan_poses

        folder = None if output is None else Path(output)
        made = plan_poses(robot, output=folder, task=task_box, watch=watch, **options)
    from robocal.cli.show_plan import show_plan

    terminal.document(made.document)
    show_plan(terminal, made, robot)
    return DONE
