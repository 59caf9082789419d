"""The verb `export`: hand a model on."""

from __future__ import annotations

import sys
from pathlib import Path

from robocal.cli.guard import DONE
from robocal.cli.terminal import Terminal
from robocal.remarks.remark import spoken, told

__all__ = ["export"]


def export(
    *,
    robot: str,
    output: str | None,
    form: str,
    nominal: str | None,
    into: str | None,
    force: bool,
    base: str | None,
    tip: str | None,
    json: bool,
) -> int:
    """export: the text on stdout, or a file."""
    terminal = Terminal(json=json)
    from robocal.jobs.export import export as job

    target = None if output is None else Path(output)
    made = job(robot, form=form, output=target, nominal=nominal, into=into, force=force, base=base, tip=tip)
    for note in made.notes:
        terminal.warn(note)
    if made.worth is not None:
        terminal.note(spoken(made.worth))
    written = None if made.written is None else str(made.written)
    terminal.document(
        {
            "format": made.form,
            "written": written,
            "text": made.text if written is None else None,
            **told(made.notes),
            "worth": None if made.worth is None else made.worth.document,
        }
    )
    if not json:
        sys.stdout.write(made.text if written is None else f"{written}\n")
    return DONE
