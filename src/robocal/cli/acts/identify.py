"""The verb `identify`: identify parameters and prove the gain."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from robocal.cli.guard import DONE, UNTRUSTED
from robocal.cli.terminal import Terminal, command_line

__all__ = ["identify"]


def identify(
    *, robot: str, data: Sequence[str], output: str | None, force: bool, iterations: int, json: bool, free: Sequence[str],
    fix: Sequence[str], prior: Sequence[str], exclude: Sequence[str], groups: Sequence[str], **choices: Any,
) -> int:  # fmt: skip
    """identify: 0 when the verdict is `improved`, 3 otherwise."""
    terminal = Terminal(json=json)
    with terminal.watching() as watch:
        from robocal.files.leaving import words_of
        from robocal.jobs.identify import Choices
        from robocal.jobs.identify import identify as job

        names = tuple(w for word in groups for part in word.split(",") if (w := part.strip()))
        chosen = Choices(
            free=tuple(free),
            fix=tuple(fix),
            prior=tuple(prior),
            exclude=words_of(exclude),
            groups=names,
            iterations=iterations,
            **choices,
        )
        folder = None if output is None else Path(output)
        outcome = job(robot, data, chosen, output=folder, force=force, command=command_line(), watch=watch)
    from robocal.cli.show import show_outcome

    terminal.document(outcome.result.model_dump(mode="json"))
    show_outcome(terminal, outcome)
    return DONE if outcome.improved else UNTRUSTED
