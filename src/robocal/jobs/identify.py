"""The verb `identify`: robot and data files in, the outcome and its run folder out."""

from __future__ import annotations

import datetime
import os
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from robocal.arms.chain import Chain
from robocal.calibrate.estimators import estimator
from robocal.calibrate.identification import Identification
from robocal.calibrate.identify import identify as solve
from robocal.calibrate.options import Options
from robocal.errors import FileError, ModelError, nearest
from robocal.files.dataset import InputFile
from robocal.files.leaving import LeftOut
from robocal.files.opened import cable_file
from robocal.files.result import Provenance
from robocal.files.runfolder import obstacle
from robocal.jobs.beside import compared, methods_of
from robocal.jobs.beyond import group_results, guard_layer, layer_result, select_groups
from robocal.jobs.inputs import Inputs, Watch, choose, computable, read_inputs
from robocal.jobs.outcome import Outcome, provenance, residual_columns, save, to_result
from robocal.jobs.region import MEASURED, working_range
from robocal.measure.machine import Machine

__all__ = ["Choices", "identify", "identify_inputs"]

HELD = ("blocks", "group")
LOSSES = ("none", "huber", "cauchy", "tukey")


@dataclass(frozen=True)
class Choices:
    """What a person may choose for a run; names are parameters, symbols, owners or frames, priors read NAME=SIGMA."""

    method: str = "lm"
    loss: str = "none"
    hold_out: float | str | None = None
    folds: int | None = None
    blocks: int = 10
    reselect: bool = False
    group: str | None = None
    leave_one_out: bool | None = None
    keep_all: bool = False
    iterations: int = 100
    particles: int = 1000
    bootstrap: int | None = None
    seed: int = 0
    free: tuple[str, ...] = ()
    fix: tuple[str, ...] = ()
    prior: tuple[str, ...] = ()
    base: str | None = None
    tip: str | None = None
    compare: str | None = None
    exclude: tuple[str, ...] = ()
    groups: tuple[str, ...] = ()
    layer: bool = False
    region: str | None = None

    @property
    def options(self) -> Options:
        """The same for the solver. Raises ModelError for words it does not know."""
        methods_of(self.compare, self.method)
        method = estimator(self.method, self.loss if self.loss in LOSSES else "none")
        if self.loss not in LOSSES:
            raise ModelError(
                "unknown option",
                key="--loss",
                found=self.loss,
                expected=", ".join(LOSSES),
                suggestion=nearest(self.loss, LOSSES),
            )
        held = share(self.hold_out)
        if self.folds is not None and isinstance(held, float):
            raise ModelError(
                "with folds everything is held out once",
                key="--hold-out",
                found=held,
                expected="blocks, group, or nothing",
            )
        if self.reselect and self.folds is None:
            raise ModelError("nothing is selected anew without folds", key="--reselect", expected="--folds K as well")
        return Options(
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
        """Every choice, for the recipe; links of a URDF when they were given."""
        return {k: v for k, v in asdict(self).items() if k not in ("base", "tip", "compare", "region") or v is not None}


def share(given: float | str | None) -> float | str | None:
    """A held-out share as a number, or the word that says what is held out. Raises ModelError for anything else."""
    if given is None or given in HELD:
        return given
    try:
        number = float(given)
    except ValueError:
        near = nearest(str(given), HELD)
        expected = f"a share from 0 to 0.5, {', '.join(HELD)}"
        raise ModelError("unknown option", key="--hold-out", found=given, expected=expected, suggestion=near) from None
    if not 0 <= number <= 0.5:
        raise ModelError("the held-out share must lie between 0 and 0.5", key="--hold-out", found=given)
    return number


def identify(
    robot: str,
    data: Sequence[str | os.PathLike[str]],
    choices: Choices | None = None,
    *,
    output: Path | None = None,
    force: bool = False,
    command: str = "",
    watch: Watch | None = None,
) -> Outcome:
    """Identifies a robot from files; with `output`, writes the run folder, into one that holds anything but an untouched run
    only with `force`. Raises InputError for whatever is wrong with them."""
    choices = choices or Choices()
    _ = choices.options
    if output is not None and output.exists() and not output.is_dir():
        raise FileError("this is not a folder", file=output, expected="a folder for the run, or a new name")
    if output is not None and not force and (there := obstacle(output)):
        raise there
    if (cable := cable_file(robot)) is not None:
        from robocal.jobs.cable.identify import identify_cable

        timed = Timed()
        made = identify_cable(cable, robot, data, choices.options, asdict(choices), watch, choices.exclude)
        measured = made.measured
        recipe = recipe_of(made.found, choices, command, measured.files, timed, measured.reading.left_out)
        result = to_result(made.found, made.robot, recipe, measured.warnings)
        return saved(Outcome(result, residual_columns(made.found), made.found, made.robot), output, watch)
    links = {"base": choices.base, "tip": choices.tip}
    inputs = read_inputs(robot, data, **links, group=choices.group, exclude=choices.exclude, watch=watch)
    return identify_inputs(inputs, choices, output=output, command=command, watch=watch)


def identify_inputs(
    inputs: Inputs,
    choices: Choices | None = None,
    *,
    output: Path | None = None,
    command: str = "",
    watch: Watch | None = None,
) -> Outcome:
    """The same from inputs that were read already."""
    choices = choices or Choices()
    timed = Timed()
    robot, data = choose(inputs.robot, inputs.data, free=choices.free, fix=choices.fix, prior=choices.prior)
    region, read = working_range(robot, data, choices.region)
    options, every = replace(choices.options, region=region), (*inputs.files, *read)
    with computable(*(i.file for i in every)):
        robot, tried = select_groups(robot, data, choices.groups, options, watch)
        found: Identification[Chain] = solve(robot.chain, data, options, watch)
        seconds = timed.seconds
        methods = methods_of(choices.compare, choices.method)
        known = (found, seconds)
        others = compared(robot.chain, data, methods, options, known, watch) if methods else None
        guarded = guard_layer(found, data, watch) if choices.layer else None
    said = (*inputs.warnings, *(remark for file in read for remark in file.remarks))
    recipe = recipe_of(found, choices, command, every, timed, inputs.reading.left_out)
    more = {"comparison": others, "layer": layer_result(guarded)} | group_results(robot, tried)
    result = to_result(found, robot, recipe, said).model_copy(update=more)
    outcome = Outcome(result, residual_columns(found), found, robot, layer=guarded.layer if guarded else None)
    return saved(outcome, output, watch)


class Timed:
    """When a run started, and how long it has taken."""

    def __init__(self) -> None:
        self.started, self._clock = datetime.datetime.now(datetime.UTC), time.perf_counter()

    @property
    def seconds(self) -> float:
        """Since the start."""
        return time.perf_counter() - self._clock


def recipe_of(
    found: Identification[Machine],
    choices: Choices,
    command: str,
    inputs: Sequence[InputFile],
    timed: Timed,
    left_out: Sequence[LeftOut],
) -> Provenance:
    """What made the result of a run; what was left to us is recorded as it was decided."""
    decided = {
        "hold_out": found.options.hold_out,
        "leave_one_out": any(s.leave_one_out is not None for s in found.stages),
    }
    stamp = timed.started.isoformat(timespec="seconds")
    return provenance(command, inputs, choices.seed, stamp, timed.seconds, choices.record | decided, left_out)


def saved(outcome: Outcome, output: Path | None, watch: Watch | None) -> Outcome:
    """The outcome, with its run folder written where one was asked for."""
    if output is None:
        return outcome
    if watch:
        watch({"stage": "report"})
    return save(outcome, output)
