"""The application: its verbs in the order of the help, each made a command of typer from its options, and what it hands back taken
to terminal and exit status.

    verbs/NAME.py: Options, run(options, watch, command) -> Outcome, sections(outcome), and details(outcome) for pages

This is the only place that knows how a verb is called; a verb knows nothing of terminals. Only cheap imports here:
`robocal --help` must answer at once.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

import typer

from robocal.cli.guard import DONE, UNTRUSTED, complain
from robocal.cli.terminal import Terminal, command_line
from robocal.remarks.remark import full_text
from robocal.verbs.option import Arg, OptionField, entries
from robocal.verbs.registry import CABLE, COMMAND_NAMES, VERBS

__all__ = ["Task", "build", "command"]

HELP = """Identify the true parameters of a robot from measurements, with their uncertainty, and prove the gain.

\b
  robocal demo                      calibrate three arms, read the reports
  robocal new ur10 -o cell          a robot and a data file to fill in
  robocal check cell/robot.yaml cell/data.yaml
  robocal identify cell/robot.yaml cell/data.yaml -o run
  robocal cable workspace robot.yaml -o held    cable robots: see robocal cable --help

\b
Exit status: 0 done; 2 the input is wrong, nothing was written;
3 it ran, but the result must not be trusted; 130 stopped.
"""

CABLES = """Cable-driven parallel robots: lengths, poses, tensions, workspaces, lists of poses.

robocal new cable writes a file to start from."""


def build(words: Sequence[str] = (*VERBS, *COMMAND_NAMES.values(), *CABLE)) -> typer.Typer:
    """The application for a command line: only the verbs that it names are read, the others have but their line of help."""
    app = typer.Typer(
        help=HELP,
        no_args_is_help=True,
        add_completion=False,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    )
    app.callback()(_root)
    _verbs(app, VERBS, "", words)
    group = typer.Typer(help=CABLES, no_args_is_help=True, rich_markup_mode=None)
    _verbs(group, CABLE, "cable.", words)
    app.add_typer(group, name="cable", short_help="Cable-driven parallel robots.")
    return app


def _verbs(app: typer.Typer, verbs: Mapping[str, str], under: str, words: Sequence[str]) -> None:
    for name, short in verbs.items():
        word = COMMAND_NAMES.get(name, name)
        app.command(word, short_help=short)(command(under + name) if word in words else _unread)


def _unread() -> None:
    """A verb that this command line does not name."""


def _version(wanted: bool) -> None:
    if wanted:
        from robocal._version import __version__

        print(f"robocal {__version__}")
        raise typer.Exit


def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show tracebacks. Accepted anywhere.")] = False,
    timings: Annotated[bool, typer.Option("--timings", help="Say where the time went. Accepted anywhere.")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", help="Say all that a page would. Accepted anywhere.")] = False,
) -> None:
    """Options of robocal itself."""


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
            complain(full_text(said), kind="warning")
        if made.note and not json:
            complain(made.note, kind="note")
    if json:
        terminal.document(made.document())
    elif listed and not made.written:
        sys.stdout.write(made.text)
    else:
        terminal.draw(module.sections(made))
    return DONE if made.trusted else UNTRUSTED


def _parameter(entry: OptionField) -> inspect.Parameter:
    """One option as typer reads it."""
    kind: Any = str if entry.kind is Path else entry.kind
    default = str(entry.default) if isinstance(entry.default, Path) else entry.default
    if entry.several:
        kind, default = list[kind], None if entry.required else list(default)
    if entry.optional or (entry.several and isinstance(entry.facts, Arg) and not entry.required):
        kind = kind | None
    default = inspect.Parameter.empty if entry.required else default
    hint = Annotated[kind, _typer_parameter(entry)]
    return inspect.Parameter(entry.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=hint)


def _typer_parameter(entry: OptionField) -> Any:
    told = entry.facts
    if isinstance(told, Arg):
        return typer.Argument(metavar=told.metavar, help=told.help, show_default=False)
    names = [n for n in (told.short, f"{entry.word}/{told.negative}" if told.negative else entry.word) if n]
    shown = not (entry.required or entry.several or entry.optional or entry.kind is bool or entry.default == "")
    metavar = None if entry.kind is bool else told.metavar or told.numbers or entry.name.upper()
    return typer.Option(*names, metavar=metavar, help=told.text, show_default=shown)


def _value(entry: OptionField, word: Any) -> Any:
    """The value of an option from what typer read."""
    if entry.several:
        return tuple(Path(w) if entry.kind is Path else w for w in word or ())
    return Path(word) if entry.kind is Path and word is not None else word
