"""`identify`: the true parameters of a robot from measurements, and the gain proven on configurations that were not used."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robocal._record import record
from robocal.fit.options import Options as Solver
from robocal.report.sections import Section
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch

if TYPE_CHECKING:
    from robocal.session.identify_outcome import IdentifyOutcome as Identified

__all__ = ["METHODS", "Options", "run", "sections"]

# The names of the estimators, known here without importing them; a test holds them to the registry.
METHODS = ("lm", "gauss-newton", "ekf", "particle", "pinv", "lse", "ekf-100")
LOSSES = ("none", "huber", "cauchy", "tukey")
HELD = ("blocks", "group")
GROUPS = "gain, eccentricity, ripple, backlash, compliance, sag, bending, expansion"
USUAL = Solver()  # what is taken where nobody says
UNRECORDED = ("robot", "data", "output", "force")  # the recipe names files by themselves
IF_GIVEN = ("base", "tip", "compare", "region", "tolerance")
IF_TRUE = ("two_stages",)


@record
class Options(BaseOptions):
    """Identify a robot's true parameters from measurements, and prove the gain on configurations that were not used.

    \b
    robocal identify robot.yaml data.yaml -o run
    robocal identify ur10 tracker.csv camera.yaml --fix j1 --loss huber
    robocal identify rv-2aj data.yaml --method pinv --free alpha,beta,d,r
    robocal identify panda front.yaml right.yaml high.yaml --hold-out group --folds 3
    robocal identify robot.yaml data.yaml --compare
    robocal identify robot.yaml lengths.yaml pixels.yaml --two-stages
    robocal identify robot.yaml data.yaml --groups eccentricity,ripple,compliance --layer

    Exit status 0 when the verdict is improved; 3 when it is not, or when it holds only where it was
    measured (see --region).
    """

    robot: w.Robot
    data: w.Data
    output: Path | None = option(None, "Write a run folder here", "DIR", short="-o")
    force: bool = option(False, "Write the run into a folder with other content; files of other names stay")
    free: tuple[str, ...] = option(
        (),
        "Free exactly these parameters, in place of those of the robot file: j2.alpha, alpha, j2, tool. Repeat, or separate by commas",
        "NAME",
    )
    fix: tuple[str, ...] = option((), "Fix these parameters; also frames of data files", "NAME")
    prior: tuple[str, ...] = option(
        (),
        "Standard deviation before the measurements, in the robot file's units or in its own (2mm); length=... and angle=... for all",
        "NAME=SIGMA",
    )
    exclude: w.Exclude = ()
    groups: tuple[str, ...] = option(
        (),
        f"Try these beyond geometry; each enters only if unseen blocks of rows get better: {GROUPS}",
        "NAMES",
        listed=True,
    )
    layer: bool = option(False, "Try a residual layer on top; used only if unseen blocks of rows get better")
    region: str | None = option(
        None,
        "Where the robot works: a list of poses, or ranges of joints; measured: the measured range is enough",
        "FILE",
        otherwise="joint limits that you wrote (not those of a catalogue robot), else where it was measured",
    )
    method: str = option(
        USUAL.method,
        "lm, gauss-newton, ekf, particle; to compare with: pinv (iterated pseudo-inverse), lse (one step), ekf-100",
        "METHOD",
    )
    compare: str | None = option(
        None,
        "Try several estimators on the same split, side by side: say lm,ekf,lse; alone: all that are worth it",
        "[METHODS]",
    )
    two_stages: bool = option(
        False,
        "Also identify in two stages, on the same split: a map of the markers from images alone, then the robot with that map",
    )
    loss: str = option(USUAL.loss, f"{', '.join(LOSSES)}: reduces the weight of outliers", "LOSS", choices=LOSSES)
    hold_out: str | float | None = option(
        None,
        "Share of configurations held out, 0 to 0.5; blocks: rows in time order; group: whole groups",
        "SHARE",
        otherwise="stated groups; else 0.2 from 25 places on, or 5 folds where that is likely to prove too little",
    )
    group: str | None = option(None, "The column whose groups are held out together", "COLUMN", name="--group-by")
    folds: int | None = option(None, "Hold out everything once, in K rounds, and fit the model to everything", "K")
    blocks: int = option(USUAL.blocks, "Number of blocks, with --hold-out blocks", "N", least=2)
    reselect: bool = option(False, "With --folds: estimate noise and select observable parameters again in every round")
    leave_one_out: bool | None = option(
        None,
        "Predict every configuration from all the others",
        negative="--no-leave-one-out",
        otherwise="up to 400 configurations",
    )
    keep_all: bool = option(False, "Fit also parameters that the data cannot separate")
    iterations: int = option(USUAL.max_iterations, "Maximum number of iterations", "N", least=1)
    tolerance: float | None = option(
        None,
        "Stop where the greatest error of any measurement is no larger",
        "ERROR",
        unit="length",
        above=0,
        otherwise="go to the minimum",
    )
    particles: int = option(USUAL.particles, "Number of particles, for --method particle", "N", least=50, most=100_000)
    bootstrap: int | None = option(
        None, "Draw the configurations N times again: intervals without a model of the noise", "N"
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
            raise ModelError("without folds nothing is selected again", key="--reselect", expected="--folds K as well")
        same = {f.name: self.given[f.name] for f in fields(Solver) if f.name in self.given}
        # The seeds' way uses everything that was measured, unless somebody asks for proof.
        share_held = 0.0 if method.blind and self.hold_out is None else held
        own = {"hold_out": share_held, "max_iterations": self.iterations, "measured": self.region == MEASURED}
        return Solver(**{**same, **own, "region": None, "tolerance": None})  # these two follow from robot and data

    @property
    def record(self) -> dict[str, Any]:
        """Every choice, for the recipe; links of a URDF and the like when they were given."""
        given = {k: v for k, v in self.given.items() if k not in UNRECORDED}
        return {k: v for k, v in given.items() if (k not in IF_GIVEN or v is not None) and (k not in IF_TRUE or v)}


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


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Identified]:
    """Identifies a robot from files; a folder gets the run, one that holds anything but an untouched run only with `force`.
    Raises InputError for whatever is wrong with them."""
    from robocal.errors import FileError
    from robocal.files.result import document
    from robocal.files.runfolder import obstacle
    from robocal.remarks.code import Code
    from robocal.session.identify_outcome import save

    solver = o.solver
    if o.output is not None and o.output.exists() and not o.output.is_dir():
        raise FileError("this is not a folder", file=o.output, expected="a folder for the run, or a new name")
    if o.output is not None and not o.force and (there := obstacle(o.output)):
        raise there
    made = identify_machine(o, solver, watch, command)
    if o.output is not None:
        if watch:
            watch({"stage": "report"})
        made = save(made, o.output)
    # A prediction is no warning; it is in the document.
    said = tuple(r for r in made.result.remarks if r.code != Code.ELSEWHERE)
    return Outcome(made, lambda: document(made.result), made.improved, said, written=made.written)


def identify_machine(o: Options, solver: Solver, watch: Watch | None, command: str) -> Identified:
    """A machine and its data, identified; what only an arm has (groups beyond geometry, a residual layer, other estimators beside
    this one) where it was asked for. Raises InputError for whatever is wrong with them."""
    from robocal.prove.identify import identify
    from robocal.session.identify_outcome import IdentifyOutcome, residual_columns, to_result
    from robocal.session.inputs import choose, read_inputs
    from robocal.session.watching import computable
    from robocal.verbs.identify.result import Timed, beside, recipe_of, with_groups, working_range

    inputs = read_inputs(
        o.robot, o.data, base=o.base, tip=o.tip, group=o.group, exclude=o.exclude, watch=watch, choices=o.given
    )
    timed = Timed()
    opened, data = choose(inputs.opened, inputs.data, free=o.free, fix=o.fix, prior=o.prior)
    if o.two_stages:
        from robocal.session.two_stages import views_of_map

        views_of_map(data)
    region, read = working_range(opened, data, o.region)
    options = replace(solver, region=region, tolerance=o.si(opened.units).tolerance)
    every = (*inputs.files, *read)
    with computable(*(i.file for i in every)):
        opened, more = with_groups(opened, data, o.groups, options, watch)
        found = identify(opened.machine, data, options, watch)
        layer, parts, compared = beside(opened, data, found, o, (options, timed.seconds), watch)
    said = (*inputs.warnings, *(remark for file in read for remark in file.remarks))
    recipe = recipe_of(found, o.record, command, every, timed, inputs.reading.left_out)
    result = replace(to_result(found, opened, recipe, said), **more, **parts)
    return IdentifyOutcome(result, residual_columns(found), found, opened, layer=layer, compared=compared)


def sections(made: Outcome[Identified]) -> Iterator[Section]:
    """The whole story of one identification, and where it was written."""
    from robocal.report.identified import closing_section, identification_sections
    from robocal.session.identify_outcome import map_columns

    found: Identified = made.result
    cells, rows = lambda: map_columns(found.identification), found.residuals
    yield from identification_sections(found.result, rows, cells, compared=found.compared)
    yield closing_section(found.result, made.written, found.left_out)
