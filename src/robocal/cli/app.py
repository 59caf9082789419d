"""The application: its verbs in the order of the help. What a verb takes is in `verbs/`, what it does in `acts/` and
`robocal.jobs`.

Only cheap imports here: `robocal --help` must answer at once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import typer

from robocal.cli.verbs.cable import CABLE
from robocal.cli.verbs.finding import check, demo, identify, validate
from robocal.cli.verbs.handing import compensate, export, report
from robocal.cli.verbs.making import new, simulate
from robocal.cli.verbs.planning import plan
from robocal.cli.verbs.trusting import drift, predict

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


def build() -> typer.Typer:
    """The application."""
    app = typer.Typer(
        help=HELP,
        no_args_is_help=True,
        add_completion=False,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    )
    app.callback()(_root)
    for verb, short in VERBS.items():
        app.command(verb.__name__, short_help=short)(verb)
    group = typer.Typer(help=CABLES, no_args_is_help=True, rich_markup_mode=None)
    for verb, short in CABLE.items():
        group.command(verb.__name__, short_help=short)(verb)
    app.add_typer(group, name="cable", short_help="Cable-driven parallel robots.")
    return app


VERBS: dict[Callable[..., Any], str] = {
    demo: "Watch three arms being calibrated.",
    new: "Write files to start from.",
    plan: "Choose which poses to measure, and how many.",
    check: "Say what files contain and what they can tell.",
    identify: "Identify true parameters, and prove the gain.",
    predict: "Where the tool is, with 95 % bands.",
    validate: "Measure a model's error on other data.",
    drift: "Has a robot changed between two calibrations?",
    compensate: "Correct targets for a controller that keeps its model.",
    export: "Hand a model on: YAML, URDF, table, offsets.",
    simulate: "Simulate measurements of an imperfect robot.",
    report: "Write report.html again.",
}


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
