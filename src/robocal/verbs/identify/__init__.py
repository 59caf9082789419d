"""`identify`: the true parameters of a robot from measurements, and the gain proven on configurations that were not used."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robocal.fit.options import Options as Solver
from robocal.report.sections import Section
from robocal.verbs import words as w
from robocal.verbs.option import Told, opt
from robocal.verbs.outcome import Outcome, Watch

if TYPE_CHECKING:
    from robocal.files.cable.cablefile import CableFile
    from robocal.session.outcome import Outcome as Identified

__all__ = ["METHODS", "Options", "run", "sections"]

# The names of the estimators, known here without importing them; a test holds them to the registry.
METHODS = ("lm", "gauss-newton", "ekf", "particle", "pinv", "lse", "ekf-100")
LOSSES = ("none", "huber", "cauchy", "tukey")
HELD = ("blocks", "group")
GROUPS = "gain, eccentricity, ripple, backlash, compliance, sag, bending, expansion"
USUAL = Solver()  # what is taken where nobody says
UNRECORDED = ("robot", "data", "output", "force")  # the recipe names files by themselves
IF_GIVEN = ("base", "tip", "compare", "region", "tolerance")


@dataclass(frozen=True)
class Options(Told):
    """Identify a robot's true parameters from measurements, and prove the gain on configurations that were not used.

    \b
    robocal identify robot.yaml data.yaml -o run
    robocal identify ur10 tracker.csv camera.yaml --fix j1 --loss huber
    robocal identify rv-2aj data.yaml --method pinv --free alpha,beta,d,r
    robocal identify panda front.yaml right.yaml high.yaml --hold-out group --folds 3
    robocal identify robot.yaml data.yaml --compare
    robocal identify robot.yaml data.yaml --groups eccentricity,ripple,compliance --layer

    Exit status 0 when the verdict is improved, 3 when it is not, or only where it was measured (see --region).
    """

    robot: w.Robot
    data: w.Data
    output: Path | None = opt(None, "Write a run folder here", short="-o", metavar="DIR")
    force: bool = opt(False, "Write the run into a folder that holds something else; files of other names stay")
    free: tuple[str, ...] = opt(
        (),
        "Free exactly these, not what the robot file says: j2.alpha, alpha, j2, tool. Repeat, or separate by commas",
        metavar="NAME",
    )
    fix: tuple[str, ...] = opt((), "Hold these; also frames of data files", metavar="NAME")
    prior: tuple[str, ...] = opt(
        (),
        "Standard deviation expected beforehand, in the robot file's units; length=... and angle=... for all",
        metavar="NAME=SIGMA",
    )
    exclude: w.Exclude = ()
    groups: tuple[str, ...] = opt(
        (),
        f"Try these beyond geometry; each enters only if unseen blocks of rows get better: {GROUPS}",
        metavar="NAMES",
        listed=True,
    )
    layer: bool = opt(False, "Try a residual layer on top; used only if unseen blocks of rows get better")
    region: str | None = opt(
        None,
        "Where the robot works: a list of poses, or ranges of joints; measured: where it was measured will do",
        metavar="FILE",
        otherwise="joint limits that you wrote (a catalogue's are the maker's), else where it was measured",
    )
    method: str = opt(
        USUAL.method,
        "lm, gauss-newton, ekf, particle; to compare with: pinv (iterated pseudo-inverse), lse (one step), ekf-100",
        metavar="METHOD",
    )
    compare: str | None = opt(
        None,
        "Try several estimators on the same split, side by side: say lm,ekf,lse; alone: all that are worth it",
        metavar="[METHODS]",
    )
    loss: str = opt(USUAL.loss, f"{', '.join(LOSSES)}: what outliers may weigh", metavar="LOSS", choices=LOSSES)
    hold_out: str | float | None = opt(
        None,
        "Share of configurations kept for judging, 0 to 0.5; blocks of rows in time order; or group, whole groups",
        metavar="SHARE",
        otherwise="0.2 from 25 configurations on",
    )
    group: str | None = opt(None, "The column that says what is held out together", name="--group-by", metavar="COLUMN")
    folds: int | None = opt(None, "Hold out everything once, in K rounds, and fit the model to everything", metavar="K")
    blocks: int = opt(USUAL.blocks, "How many, with --hold-out blocks", metavar="N", least=2)
    reselect: bool = opt(False, "With --folds: find noise and what is seen anew in every round")
    leave_one_out: bool | None = opt(
        None,
        "Predict every configuration from all the others",
        negative="--no-leave-one-out",
        otherwise="up to 400 configurations",
    )
    keep_all: bool = opt(False, "Fit also what the data cannot tell apart")
    iterations: int = opt(USUAL.max_iterations, "At most this many", metavar="N", least=1)
    tolerance: float | None = opt(
        None,
        "Stop where the greatest error of any measurement is no larger",
        metavar="ERROR",
        unit="length",
        above=0,
        otherwise="go to the minimum",
    )
    particles: int = opt(USUAL.particles, "For --method particle", metavar="N", least=50, most=100_000)
    bootstrap: int | None = opt(
        None, "Draw the configurations N times again: intervals that trust no model of the noise", metavar="N"
    )
    seed: w.Seed = 0
    base: w.Base = None
    tip: w.Tip = None

    @property
    def solver(self) -> Solver:
        """The same for the solver. Raises ModelError for words that it does not know, and for those that contradict."""
        from robocal.errors import ModelError
        from robocal.fit.estimators import ESTIMATORS, estimator
        from robocal.verbs.identify.result import MEASURED, methods_of

        methods_of(self.compare, self.method)
        method, held = estimator(self.method, self.loss), share(self.hold_out)
        if self.folds is not None and isinstance(held, float):
            expected = "blocks, group, or nothing"
            raise ModelError("with folds everything is held out once", key="--hold-out", found=held, expected=expected)
        if self.tolerance is not None and not method.iterates:
            some = ", ".join(name for name, e in ESTIMATORS.items() if e.iterates)
            raise ModelError("this method does not iterate", key="--tolerance", found=self.method, expected=some)
        if self.reselect and self.folds is None:
            raise ModelError("nothing is selected anew without folds", key="--reselect", expected="--folds K as well")
        return Solver(
            method=self.method,
            # The seeds' way uses everything that was measured, unless somebody asks for proof.
            hold_out=0.0 if method.blind and self.hold_out is None else held,
            folds=self.folds,
            blocks=self.blocks,
            reselect=self.reselect,
            seed=self.seed,
            loss=self.loss,
            max_iterations=self.iterations,
            leave_one_out=self.leave_one_out,
            keep_all=self.keep_all,
            particles=self.particles,
            bootstrap=self.bootstrap,
            measured=self.region == MEASURED,
        )

    @property
    def record(self) -> dict[str, Any]:
        """Every choice, for the recipe; links of a URDF and the like when they were given."""
        given = {k: v for k, v in self.given.items() if k not in UNRECORDED}
        return {k: v for k, v in given.items() if k not in IF_GIVEN or v is not None}


def share(given: float | str | None) -> float | str | None:
    """A held-out share as a number, or the word that says what is held out. Raises ModelError for anything else."""
    from robocal.errors import ModelError, nearest

    if given is None or given in HELD:
        return given
    try:
        number = float(given)
    except ValueError:
        near, expected = nearest(str(given), HELD), f"a share from 0 to 0.5, {', '.join(HELD)}"
        raise ModelError("unknown option", key="--hold-out", found=given, expected=expected, suggestion=near) from None
    if not 0 <= number <= 0.5:
        raise ModelError("the held-out share must lie between 0 and 0.5", key="--hold-out", found=given)
    return number


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome:
    """Identifies a robot from files; a folder gets the run, one that holds anything but an untouched run only with `force`.
    Raises InputError for whatever is wrong with them."""
    from robocal.errors import FileError
    from robocal.files.opened import cable_file
    from robocal.files.result import document
    from robocal.files.runfolder import obstacle
    from robocal.remarks.code import Code
    from robocal.session.outcome import save

    solver = o.solver
    if o.output is not None and o.output.exists() and not o.output.is_dir():
        raise FileError("this is not a folder", file=o.output, expected="a folder for the run, or a new name")
    if o.output is not None and not o.force and (there := obstacle(o.output)):
        raise there
    cable = cable_file(o.robot)
    made = _arm(o, solver, watch, command) if cable is None else _cables(o, cable, solver, watch, command)
    if o.output is not None:
        if watch:
            watch({"stage": "report"})
        made = save(made, o.output)
    # A prediction is no warning; it is in the document.
    said = tuple(r for r in made.result.remarks if r.code != Code.ELSEWHERE)
    return Outcome(made, lambda: document(made.result), made.improved, said, written=made.written)


def _arm(o: Options, solver: Solver, watch: Watch | None, command: str) -> Identified:
    """An arm: groups beyond geometry and a residual layer are tried where they were asked for, estimators compared."""
    from robocal.prove.identify import identify
    from robocal.session.inputs import choose, read_inputs
    from robocal.session.outcome import Outcome, residual_columns, to_result
    from robocal.session.watching import computable
    from robocal.verbs.identify.result import Timed, compared, methods_of, recipe_of, working_range

    inputs = read_inputs(o.robot, o.data, base=o.base, tip=o.tip, group=o.group, exclude=o.exclude, watch=watch)
    timed = Timed()
    robot, data = choose(inputs.robot, inputs.data, free=o.free, fix=o.fix, prior=o.prior)
    region, read = working_range(robot, data, o.region)
    solver = replace(solver, region=region, tolerance=o.si(robot.units).tolerance)
    options, every = solver, (*inputs.files, *read)
    more: dict[str, Any] = {}
    layer = None
    with computable(*(i.file for i in every)):
        if o.groups or robot.chain.groups:
            from robocal.verbs.identify.result import group_results, select_groups

            robot, tried = select_groups(robot, data, o.groups, options, watch)
            more |= group_results(robot, tried)
        found = identify(robot.chain, data, options, watch)
        seconds = timed.seconds
        if methods := methods_of(o.compare, o.method):
            more["comparison"] = compared(robot.chain, data, methods, options, (found, seconds), watch)
        if o.layer:
            from robocal.verbs.identify.result import guard_layer, layer_result

            guarded = guard_layer(found, data, watch)
            layer, more["layer"] = guarded.layer, layer_result(guarded)
    said = (*inputs.warnings, *(remark for file in read for remark in file.remarks))
    recipe = recipe_of(found, o.record, command, every, timed, inputs.reading.left_out)
    result = replace(to_result(found, robot, recipe, said), **more)
    return Outcome(result, residual_columns(found), found, robot, layer=layer)


def _cables(o: Options, file: CableFile, solver: Solver, watch: Watch | None, command: str) -> Identified:
    """A cable robot: anchors and zeros from lengths and poses."""
    from robocal.session.cable.identify import identify_cable
    from robocal.session.outcome import Outcome, residual_columns, to_result
    from robocal.verbs.identify.result import Timed, recipe_of

    timed = Timed()
    solver = replace(solver, tolerance=o.si(file.units).tolerance)
    made = identify_cable(file, o.robot, o.data, solver, o.given, watch, o.exclude)
    measured = made.measured
    recipe = recipe_of(made.found, o.record, command, measured.files, timed, measured.reading.left_out)
    result = to_result(made.found, made.robot, recipe, measured.warnings)
    return Outcome(result, residual_columns(made.found), made.found, made.robot)


def sections(made: Outcome) -> Iterator[Section]:
    """The whole story of one identification, and where it was written."""
    from robocal.report.identified import ended, identified
    from robocal.session.knowledge import map_columns

    found: Identified = made.result
    yield from identified(found.result, found.residuals, lambda: map_columns(found.identification))
    yield ended(found.result, made.written, found.left_out)
