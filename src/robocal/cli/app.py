"""The application: its verbs in the order of the help, each made a command of click from its options, and what it hands back taken
to terminal and exit status.

    verbs/NAME.py: Options, run(options, watch, command) -> Outcome, sections(outcome), and details(outcome) for pages

This is the only place that knows how a verb is called; a verb knows nothing of terminals. Only cheap imports here:
`robocal --help` must answer at once.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import click

from robocal.cli.guard import ANYWHERE, DONE, UNTRUSTED, complain
from robocal.cli.terminal import Terminal, command_line
from robocal.remarks.remark import full_text
from robocal.verbs.option import FILE_UNITS, Arg, OptionField, entries
from robocal.verbs.registry import COMMAND_NAMES, GROUPS, VERBS

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

Task = Callable[[], int]
CONTEXT = {"help_option_names": ["-h", "--help"], "max_content_width": 100}


def build() -> click.Group:
    """The application; a verb is read when a command line names it."""
    version = click.Option(
        ["--version"], is_flag=True, is_eager=True, expose_value=False, callback=_version, help="Print the version."
    )
    heard = [click.Option([n], is_flag=True, expose_value=False, help=h) for n, h in ANYWHERE.items()]
    groups = {word: (_Group(word, _Verbs(g.verbs, f"{word}."), g.help), g.line) for word, g in GROUPS.items()}
    verbs = _Verbs(VERBS, "", groups)
    return _Group("robocal", verbs, HELP, [version, *heard])


class _Verbs(Mapping[str, click.Command]):
    """Commands by their words, in the order of the help; each is made when it is asked for."""

    def __init__(
        self, verbs: Mapping[str, str], under: str, groups: Mapping[str, tuple[click.Command, str]] | None = None
    ) -> None:
        self._paths = {COMMAND_NAMES.get(name, name): under + name for name in verbs}
        self._made = {word: made for word, (made, _) in (groups or {}).items()}
        self.lines = dict(zip(self._paths, verbs.values(), strict=True))
        self.lines |= {word: line for word, (_, line) in (groups or {}).items()}

    def __getitem__(self, word: str) -> click.Command:
        if word not in self._made:
            self._made[word] = command(self._paths[word], word)
        return self._made[word]

    def __iter__(self) -> Iterator[str]:
        return iter(self.lines)

    def __len__(self) -> int:
        return len(self.lines)


class _Group(click.Group):
    """A group of verbs whose help needs none of them."""

    def __init__(self, name: str, verbs: _Verbs, help: str, params: list[click.Parameter] | None = None) -> None:
        super().__init__(name, help=help, params=params, context_settings=CONTEXT, no_args_is_help=True)
        self.commands: Any = verbs

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.commands)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(self.commands.lines.items()))


class _Argument(click.Argument):
    """An argument with a line of help."""

    def __init__(self, entry: OptionField, told: Arg) -> None:
        usage = told.metavar if entry.required else f"[{told.metavar}]"
        super().__init__([entry.name], metavar=usage, nargs=-1 if entry.several else 1, **_facts(entry))
        self.line = told.metavar, told.help + ("  [required]" if entry.required else "")


class _Number(click.types.FloatParamType):
    """A number, which is told in which unit it is wanted where it is none."""

    def __init__(self, unit: str) -> None:
        self.unit = unit
        self.words = f" in the robot file's unit of {unit}" if unit in FILE_UNITS else f" in {unit}" if unit else ""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            return float(value)
        except ValueError:
            if self.unit and value.strip()[:1] in "+-.0123456789":
                return value  # a number with its unit, which the options of the verb look at
            self.fail(f"{value!r} is not a number{self.words}", param, ctx)


class _Command(click.Command):
    """A verb: its arguments have a part of the help, before the options."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        told = [p.line for p in self.params if isinstance(p, _Argument)]
        if told:
            with formatter.section("Arguments"):
                formatter.write_dl(told)
        with formatter.section("Options"):
            records = (p.get_help_record(ctx) for p in self.get_params(ctx) if not isinstance(p, _Argument))
            formatter.write_dl([r for r in records if r])


def _version(ctx: click.Context, param: click.Parameter, wanted: bool) -> None:
    if wanted:
        from robocal._version import __version__

        print(f"robocal {__version__}")
        ctx.exit()


def command(path: str, word: str) -> click.Command:
    """The command of the verb in `robocal.verbs.PATH`; it hands back what is to be done."""
    module = import_module(f"robocal.verbs.{path}")

    def call(*, json: bool, **words: Any) -> Task:
        return partial(_done, module, words, json)

    json = click.Option(["--json"], is_flag=True, help="One JSON document on stdout, messages on stderr.")
    parameters = [*map(_parameter, entries(module.Options)), json]
    return _Command(word, callback=call, params=parameters, help=inspect.cleandoc(module.Options.__doc__ or ""))


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


def _facts(entry: OptionField) -> dict[str, Any]:
    """What click has to know of a value."""
    default = str(entry.default) if isinstance(entry.default, Path) else entry.default
    facts: dict[str, Any] = {"type": str if entry.kind is Path else entry.kind, "required": entry.required}
    if not (entry.required or entry.several):
        facts["default"] = default
    return facts


def _parameter(entry: OptionField) -> click.Parameter:
    """One option as click reads it."""
    told = entry.facts
    if isinstance(told, Arg):
        return _Argument(entry, told)
    names = [n for n in (told.short, f"{entry.word}/{told.negative}" if told.negative else entry.word) if n]
    shown = not (entry.required or entry.several or entry.optional or entry.kind is bool or entry.default == "")
    facts = _facts(entry) | ({"is_flag": True} if entry.kind is bool else {"multiple": entry.several})
    if entry.kind is float:
        facts["type"] = _Number(told.unit)
    metavar = None if entry.kind is bool else told.metavar or told.numbers or entry.name.upper()
    return click.Option([*names, entry.name], metavar=metavar, help=told.text, show_default=shown, **facts)


def _value(entry: OptionField, word: Any) -> Any:
    """The value of an option from what click read."""
    if entry.several:
        return tuple(Path(w) if entry.kind is Path else w for w in word or ())
    return Path(word) if entry.kind is Path and word is not None else word
