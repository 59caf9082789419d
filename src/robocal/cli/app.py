"""The application: its verbs in the order of the help. What a verb takes and does is in `robocal.verbs`.

Only cheap imports here: `robocal --help` must answer at once.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated

import typer

from robocal.cli.adapter import command
from robocal.verbs.registry import CABLE, VERBS, WORDS

__all__ = ["build"]

HELP = """Find out what a robot really is: its true parameters from measurements, with honest uncertainty.

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


def build(words: Sequence[str] = (*VERBS, *WORDS.values(), *CABLE)) -> typer.Typer:
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
        word = WORDS.get(name, name)
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
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Say which robocal this is.")
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show tracebacks. Accepted anywhere.")] = False,
) -> None:
    """Options of robocal itself."""
