"""The verb `validate`: a model's error on other data."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from robocal.cli.guard import DONE, UNTRUSTED
from robocal.cli.terminal import Terminal, command_line

__all__ = ["validate"]


def validate(
    *,
    robot: str,
    data: Sequence[str],
    against: str | None,
    offsets: str | None,
    distances: str,
    exclude: Sequence[str],
    output: str | None,
    seed: int,
    base: str | None,
    tip: str | None,
    json: bool,
) -> int:
    """validate: 3 when the figures mean nothing."""
    terminal = Terminal(json=json)
    with terminal.watching() as watch:
        from robocal.jobs.validate import validate as job

        folder = None if output is None else Path(output)
        found = job(
            robot,
            data,
            against=against,
            offsets=offsets,
            distances=distances,
            exclude=exclude,
            seed=seed,
            base=base,
            tip=tip,
            output=folder,
            command=command_line(),
            watch=watch,
        )
    from robocal.cli.show_validation import show_validation

    terminal.document(found.document)
    show_validation(terminal, found)
    return DONE if found.trusted else UNTRUSTED
