"""The verb `new`: files to start from."""

from __future__ import annotations

from pathlib import Path

from robocal.cli.guard import DONE
from robocal.cli.terminal import Terminal

__all__ = ["new"]


def new(*, robot: str | None, output: str, joints: int, kind: str, force: bool, listing: bool, json: bool) -> int:
    """new: files to start from, or the list of what there is."""
    terminal = Terminal(json=json)
    from robocal.errors import ModelError
    from robocal.jobs.new import listing as names
    from robocal.jobs.new import new as job

    if listing:
        from robocal.cli.show_more import show_listing

        found = names()
        terminal.document(
            {
                "robots": [
                    dict(zip(("name", "robot", "convention", "joints", "source"), r, strict=True)) for r in found.robots
                ],
                "conventions": [
                    dict(zip(("name", "formula", "complete", "source"), c, strict=True)) for c in found.conventions
                ],
            }
        )
        show_listing(terminal, found)
        return DONE
    if robot is None:
        raise ModelError(
            "which robot? give a name of the catalogue, a convention, or cable",
            expected="robocal new --list shows them",
        )
    made = job(robot, Path(output), joints=joints, kind=kind, force=force)
    terminal.document({"name": made.name, "convention": made.convention, "written": [str(p) for p in made.written]})
    if not json:
        terminal.say(f"{made.name}, convention {made.convention}:" if made.convention else f"{made.name}:")
        for path in made.written:
            terminal.say(f"  {path}")
        verb = "check" if made.convention else "cable tension"
        terminal.say(f"Fill them in, then: robocal {verb} {made.written[0]} {made.written[1]}")
    return DONE
