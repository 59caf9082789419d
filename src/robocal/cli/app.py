"""The verbs, for typer. Each only says what is to be done; the doing is in `acts.py` and `robocal.jobs`.

Only cheap imports here: `robocal --help` must answer at once.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Annotated, Any

import typer

from robocal.cli import options as o

__all__ = ["build"]

Task = Callable[[], int]

HELP = """Find out what a robot really is: its true parameters from measurements, with honest uncertainty.

\b
  robocal demo                      calibrate three arms, read the reports
  robocal new ur10 -o cell          a robot and a data file to fill in
  robocal check cell/robot.yaml cell/data.yaml
  robocal identify cell/robot.yaml cell/data.yaml -o run

\b
Exit status: 0 done; 2 the input is wrong, nothing was written;
3 it ran, but the result must not be trusted; 130 stopped.
"""


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
    for verb in (demo, new, check, identify, validate, export, simulate, report):
        app.command(verb.__name__, short_help=SHORT[verb.__name__])(verb)
    return app


SHORT = {
    "demo": "Watch three arms being calibrated.",
    "new": "Write files to start from.",
    "check": "Say what files contain and what they can tell.",
    "identify": "Identify true parameters, and prove the gain.",
    "validate": "Measure a model's error on other data.",
    "export": "Hand a model on: YAML, URDF, table, offsets.",
    "simulate": "Simulate measurements of an imperfect robot.",
    "report": "Write report.html again.",
}


def _version(wanted: bool) -> None:
    if wanted:
        from robocal import __version__

        print(f"robocal {__version__}")
        raise typer.Exit


def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Say which robocal this is.")
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show tracebacks. Accepted anywhere.")] = False,
) -> None:
    """Options of robocal itself."""


def _task(verb: str, options: dict[str, Any]) -> Task:
    """The act of this verb with its options, loaded when it is called."""
    return lambda: int(getattr(import_module("robocal.cli.acts"), verb)(**options))


def demo(
    name: o.DemoName = None, output: o.DemoFolder = "robocal-demo", seed: o.Seed = 0, json: o.Json = False
) -> Task:
    """Calibrate three arms, two simulated and one really measured, and write their reports.

    \b
    rv-2aj   the Mitsubishi RV-2AJ of a published calibration (simulated)
    camera   ten real camera readings that support no calibration: refused
    tracker  a six-axis arm with typical factory errors (simulated)

    Exit status 0 when every case came out as it should.
    """
    return _task("demo", locals())


def new(
    robot: o.Template = None,
    output: o.NewFolder = ".",
    joints: o.JointCount = 6,
    kind: o.Kind = "position",
    listing: o.List = False,
    force: o.Force = False,
    json: o.Json = False,
) -> Task:
    """Write a robot file, a data file and a table to fill in.

    \b
    robocal new --list
    robocal new ur10 -o cell
    robocal new mdh-hayati --joints 5 -o cell
    """
    return _task("new", locals())


def check(
    robot: o.Robot, data: o.MaybeData = None, base: o.Base = None, tip: o.Tip = None, json: o.Json = False
) -> Task:
    """Say what robot and data files contain and what they can tell, without fitting.

    Joints, rows, where sigma comes from, what is free, and what will not be told apart and why.

    \b
    robocal check robot.yaml data.yaml
    """
    return _task("check", locals())


def identify(
    robot: o.Robot,
    data: o.Data,
    output: o.RunFolder = None,
    free: o.Free = [],  # noqa: B006
    fix: o.Fix = [],  # noqa: B006
    prior: o.Prior = [],  # noqa: B006
    method: o.Method = "lm",
    loss: o.Loss = "none",
    hold_out: o.HoldOut = None,
    leave_one_out: o.LeaveOneOut = None,
    keep_all: o.KeepAll = False,
    iterations: o.Iterations = 100,
    seed: o.Seed = 0,
    base: o.Base = None,
    tip: o.Tip = None,
    json: o.Json = False,
) -> Task:
    """Identify a robot's true parameters from measurements, and prove the gain on configurations that were not used.

    \b
    robocal identify robot.yaml data.yaml -o run
    robocal identify ur10 tracker.csv camera.yaml --fix j1 --loss huber
    robocal identify rv-2aj data.yaml --method pinv --free alpha,beta,d,r

    Exit status 0 when the verdict is improved, 3 when it is not.
    """
    return _task("identify", locals())


def validate(
    robot: o.Robot,
    data: o.Data,
    against: o.Against = None,
    output: o.ValidationFolder = None,
    seed: o.Seed = 0,
    base: o.Base = None,
    tip: o.Tip = None,
    json: o.Json = False,
) -> Task:
    """Measure the error of a robot model on data that it was not fitted to.

    The robot stays as it is. Frames of instruments that the data leave free are fitted again; the figures are then
    labelled profiled.

    \b
    robocal validate run other.yaml --against robot.yaml
    """
    return _task("validate", locals())


def export(
    robot: o.AnyRobot,
    output: o.OutputFile = None,
    form: o.Form = "yaml",
    nominal: o.Nominal = None,
    force: o.Force = False,
    base: o.Base = None,
    tip: o.Tip = None,
    json: o.Json = False,
) -> Task:
    """Hand a robot model on: robot.yaml, URDF, a table of its parameters, or joint offsets for a controller.

    \b
    robocal export run --format offsets
    robocal export run --format urdf -o calibrated.urdf
    robocal export ur10 --format markdown
    """
    return _task("export", locals())


def simulate(
    robot: o.Robot,
    output: o.SimulationFolder,
    poses: o.Poses = 80,
    at: o.At = None,
    kind: o.Kind = "position",
    noise: o.Noise = None,
    angle_noise: o.AngleNoise = None,
    length_error: o.LengthError = None,
    angle_error: o.AngleError = None,
    settings: o.Setting = [],  # noqa: B006
    frame: o.Where = "auto",
    seed: o.Seed = 0,
    force: o.Force = False,
    base: o.Base = None,
    tip: o.Tip = None,
    json: o.Json = False,
) -> Task:
    """Simulate measurements of a robot that is not quite its model: data, and the truth to compare with.

    \b
    robocal simulate irb-120 -n 80 --noise 0.05 -o sim
    robocal identify sim/robot.yaml sim/data.yaml
    robocal simulate rv-2aj --set j2.r=1.0 --length-error 0 --angle-error 0 -o sim
    """
    return _task("simulate", locals())


def report(folder: o.Run, output: o.PageFile = None, json: o.Json = False) -> Task:
    """Write report.html again, from the result.json and residuals.csv of a run folder."""
    return _task("report", locals())
