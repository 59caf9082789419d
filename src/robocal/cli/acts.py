"""What each verb does: calls its job, shows what came of it, and returns the exit status."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from robocal.cli.guard import DONE, UNTRUSTED
from robocal.cli.terminal import Terminal

__all__ = ["check", "demo", "export", "identify", "new", "report", "simulate", "validate"]


def command_line() -> str:
    """The command as it was typed, for the recipe."""
    import shlex

    return shlex.join(["robocal", *sys.argv[1:]])


def identify(
    *, robot: str, data: Sequence[str], output: str | None, iterations: int, json: bool, free: Sequence[str], fix: Sequence[str],
    prior: Sequence[str], **choices: Any,
) -> int:  # fmt: skip
    """identify: 0 when the verdict is `improved`, 3 otherwise."""
    terminal = Terminal(json=json)
    with terminal.watching() as watch:
        from robocal.jobs.identify import Choices
        from robocal.jobs.identify import identify as job

        chosen = Choices(free=tuple(free), fix=tuple(fix), prior=tuple(prior), iterations=iterations, **choices)
        folder = None if output is None else Path(output)
        outcome = job(robot, data, chosen, output=folder, command=command_line(), watch=watch)
    from robocal.cli.show import show_outcome

    terminal.document(outcome.result.model_dump(mode="json"))
    show_outcome(terminal, outcome)
    return DONE if outcome.improved else UNTRUSTED


def validate(
    *,
    robot: str,
    data: Sequence[str],
    against: str | None,
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
            seed=seed,
            base=base,
            tip=tip,
            output=folder,
            command=command_line(),
            watch=watch,
        )
    from robocal.cli.show_more import show_validation

    terminal.document(found.document)
    show_validation(terminal, found)
    return DONE if found.trusted else UNTRUSTED


def check(*, robot: str, data: Sequence[str] | None, base: str | None, tip: str | None, json: bool) -> int:
    """check: 0 when the files are right, whatever they can tell."""
    terminal = Terminal(json=json)
    with terminal.watching() as watch:
        from robocal.jobs.check import check as job

        found = job(robot, data or (), base=base, tip=tip, watch=watch)
    from robocal.cli.show_more import show_check

    terminal.document(found.document)
    show_check(terminal, found)
    return DONE


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
            "which robot? give a name of the catalogue or a convention", expected="robocal new --list shows them"
        )
    made = job(robot, Path(output), joints=joints, kind=kind, force=force)
    terminal.document({"name": made.name, "convention": made.convention, "written": [str(p) for p in made.written]})
    if not json:
        terminal.say(f"{made.name}, convention {made.convention}:")
        for path in made.written:
            terminal.say(f"  {path}")
        terminal.say(f"Fill them in, then: robocal check {made.written[0]} {made.written[1]}")
    return DONE


def export(
    *,
    robot: str,
    output: str | None,
    form: str,
    nominal: str | None,
    force: bool,
    base: str | None,
    tip: str | None,
    json: bool,
) -> int:
    """export: the text on stdout, or a file."""
    terminal = Terminal(json=json)
    from robocal.jobs.export import export as job

    target = None if output is None else Path(output)
    made = job(robot, form=form, output=target, nominal=nominal, force=force, base=base, tip=tip)
    for note in made.notes:
        terminal.warn(note)
    written = None if made.written is None else str(made.written)
    terminal.document(
        {
            "format": made.form,
            "written": written,
            "text": made.text if written is None else None,
            "warnings": list(made.notes),
        }
    )
    if not json:
        sys.stdout.write(made.text if written is None else f"{written}\n")
    return DONE


def simulate(*, robot: str, output: str, json: bool, **options: Any) -> int:
    """simulate: robot, data and truth in a folder."""
    terminal = Terminal(json=json)
    with terminal.watching() as watch:
        from robocal.jobs.simulate import simulate as job

        made = job(robot, Path(output), watch=watch, **options)
    terminal.document(
        {
            "robot": made.robot.name, "simulated": True, "kind": made.instrument.kind, "configurations": len(made.data.configurations),
            "seed": made.seed, "largest_error_mm": made.largest_error * 1e3, "written": [str(p) for p in made.written],
        }
    )  # fmt: skip
    if not json:
        count = len(made.data.configurations)
        terminal.say(
            f"Simulated {made.robot.name}: {count} configurations, the model is wrong by up to {made.largest_error * 1e3:.3g} mm."
        )
        for path in made.written:
            terminal.say(f"  {path}")
        names = {p.stem: p for p in made.written if p.suffix != ".csv"}
        terminal.say(f"Next: robocal identify {names['robot']} {names['data']}")
    return DONE


def report(*, folder: str, output: str | None, json: bool) -> int:
    """report: the page of a run folder, once more."""
    terminal = Terminal(json=json)
    from robocal.jobs.report import report as job

    written = job(Path(folder), None if output is None else Path(output))
    terminal.document({"written": str(written)})
    terminal.say(str(written))
    return DONE


def demo(*, name: str | None, output: str, seed: int, json: bool) -> int:
    """demo: 0 when every case came out as it should."""
    from robocal.cli.show_demo import show_demo

    return DONE if show_demo(Terminal(json=json), name, Path(output), seed) else UNTRUSTED
