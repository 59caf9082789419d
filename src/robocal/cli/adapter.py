"""From the options of a verb to a command of typer, and from what it hands back to terminal and exit status.

    verbs/NAME.py: Options, run(options, watch, command) -> Outcome, sections(outcome), and details(outcome) for pages

This is the only place that knows how a verb is called; a verb knows nothing of terminals.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

import typer

from robocal.cli.guard import DONE, UNTRUSTED
from robocal.cli.terminal import Terminal, command_line
from robocal.verbs.option import Arg, Entry, entries

__all__ = ["Task", "command"]

Task = Callable[[], int]
JSON = typer.Option("--json", help="One JSON document on stdout, messages on stderr.")


def command(path: str) -> Callable[..., Task]:
    """The function that typer reads for the verb in `robocal.verbs.PATH`; it hands back what is to be done."""
    module = import_module(f"robocal.verbs.{path}")

    def call(*, json: bool, **words: Any) -> Task:
        return lambda: _done(module, words, json)

    told = entries(module.Options)
    parameters = [_parameter(entry) for entry in told]
    parameters.append(
        inspect.Parameter("json", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=Annotated[bool, JSON])
    )
    call.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    call.__annotations__ = {p.name: p.annotation for p in parameters}
    call.__doc__ = inspect.cleandoc(module.Options.__doc__ or "")
    return call


def _done(module: ModuleType, words: dict[str, Any], json: bool) -> int:
    """Runs the verb and shows what came of it."""
    terminal = Terminal(json=json)
    options = module.Options(**{e.name: _value(e, words[e.name]) for e in entries(module.Options)})
    with terminal.watching() as watch:
        made = module.run(options, watch, command_line())
    listed = made.text is not None
    if json or listed:
        for said in made.remarks:
            terminal.warn(said)
        if made.note and not json:
            terminal.note(made.note)
    if json:
        terminal.document(made.document())
    elif listed and not made.written:
        sys.stdout.write(made.text)
    else:
        terminal.draw(module.sections(made))
    return DONE if made.trusted else UNTRUSTED


def _parameter(entry: Entry) -> inspect.Parameter:
    """One option as typer reads it."""
    kind: Any = str if entry.kind is Path else entry.kind
    default = entry.default
    if entry.several:
        kind, default = list[kind], None if entry.required else list(default)
    if entry.optional or (entry.several and isinstance(entry.told, Arg) and not entry.required):
        kind = kind | None
    if isinstance(default, Path):
        default = str(default)
    default = inspect.Parameter.empty if entry.required else default
    hint = Annotated[kind, _told(entry)]
    return inspect.Parameter(entry.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=hint)


def _told(entry: Entry) -> Any:
    told = entry.told
    if isinstance(told, Arg):
        return typer.Argument(metavar=told.metavar, help=told.help, show_default=False)
    names = [n for n in (told.short, f"{entry.word}/{told.negative}" if told.negative else entry.word) if n]
    shown = not (entry.required or entry.several or entry.optional or entry.kind is bool or entry.default == "")
    metavar = None if entry.kind is bool else told.metavar or told.numbers or entry.name.upper()
    return typer.Option(*names, metavar=metavar, help=told.text, show_default=shown)


def _value(entry: Entry, word: Any) -> Any:
    """The value of an option from what typer read."""
    if entry.several:
        return tuple(Path(w) if entry.kind is Path else w for w in word or ())
    return Path(word) if entry.kind is Path and word is not None else word
