"""What `identify` takes and hands on around the identification itself.

recipe          what was chosen, what was read, when, and how long it took
working range   the joint limits that its user wrote, or a file. Limits that a catalogue or a URDF brings are the maker's: what the
                arm can reach, mostly full turns, and not where it works
groups, layer   what is tried beyond geometry, and how that is told
methods         the other estimators, beside the one that was chosen
"""

from __future__ import annotations

import dataclasses
import datetime
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from robocal.arms.chain import Chain
from robocal.errors import ModelError
from robocal.files import evidence_parts as files
from robocal.files.display import to_display
from robocal.files.parts import RowsLeftOut, provenance_of
from robocal.files.plain import plain
from robocal.files.result import Provenance
from robocal.files.robot import Robot
from robocal.files.text import InputFile
from robocal.files.unread import LeftOut
from robocal.fit.estimators import ESTIMATORS, estimator
from robocal.fit.noise import apply_noise
from robocal.fit.options import JointRegion, Options
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.prove.bands import range_of_joints
from robocal.prove.identify import Identification
from robocal.prove.place_bands import TURN, between
from robocal.prove.region import SAMPLES, region_of_limits
from robocal.prove.split import default_hold_out, make_split
from robocal.session.opened import Opened
from robocal.session.watching import Watch

if TYPE_CHECKING:
    from robocal.prove.compare import MethodEntry
    from robocal.prove.nongeometric.layer import Guarded, Layer

__all__ = ["MEASURED", "Timed", "beside", "methods_of", "recipe_of", "with_groups", "working_range"]

O = TypeVar("O", bound=Opened[Any])


class Timed:
    """When a run started, and how long it has taken."""

    def __init__(self) -> None:
        self.started, self._clock = datetime.datetime.now(datetime.UTC), time.perf_counter()

    @property
    def seconds(self) -> float:
        """Since the start."""
        return time.perf_counter() - self._clock


def recipe_of(
    found: Identification[Model],
    choices: Mapping[str, Any],
    command: str,
    inputs: Sequence[InputFile],
    timed: Timed,
    left_out: Sequence[LeftOut],
) -> Provenance:
    """What made the result of a run; what was left to us is recorded as it was decided."""
    left_one_out = any(s.leave_one_out is not None for s in found.stages)
    decided = {"hold_out": found.options.hold_out, "leave_one_out": left_one_out}
    return to_display(
        Provenance,
        provenance_of(command, inputs),
        seed=choices["seed"],
        started=timed.started.isoformat(timespec="seconds"),
        seconds=round(timed.seconds, 3),
        options=plain({**choices, **decided}),
        left_out=[to_display(RowsLeftOut, o) for o in left_out],
    )


TWO_STAGES = "two-stages"
MEASURED = "measured"  # the word for: where it was measured will do


def working_range(
    opened: Opened[Any], data: DataSet, given: str | None
) -> tuple[JointRegion | None, tuple[InputFile, ...]]:
    """The working range, None where nobody named one or no joints span one, and the files read. Raises FileError or FormatError."""
    robot = opened.arm
    if robot is None:
        return None, ()
    own = _written(robot)
    if given is None or given == MEASURED:
        return (region_of_limits(robot.chain, data) if own else None), ()
    from robocal.files.pose_table import read_region

    found = read_region(Path(given), robot.chain)
    name = f"region of {Path(given).name}"
    if found.joints is not None:
        return JointRegion(found.joints, name), found.files
    assert found.ranges is not None
    measured = range_of_joints(data.configurations)
    rest = np.tile([-TURN, TURN], (len(found.ranges), 1)) if measured is None else measured
    if own:
        rest = np.where(np.isfinite(robot.chain.limits), robot.chain.limits, rest)
    return JointRegion(between(np.where(np.isnan(found.ranges), rest, found.ranges), SAMPLES), name), found.files


def _written(robot: Robot) -> bool:
    """Whether somebody wrote the joint limits into the robot file, and not the maker's out of the catalogue."""
    limits = robot.chain.limits
    if robot.format != "yaml" or robot.path is None or not np.isfinite(limits).any():
        return False
    from robocal.arms.catalog import LIMITS

    makers = map(np.array, LIMITS.values())
    return not any(limits.shape == m.shape and np.allclose(limits, m, rtol=0.0, atol=1e-4) for m in makers)


def with_groups(
    opened: O, data: DataSet, names: Sequence[str], options: Options, watch: Watch | None
) -> tuple[O, dict[str, Any]]:
    """The machine with the groups beyond geometry that its data support, and what a result says of them: what was tried, and what the
    machine has, so that it can be made again. Of a machine without groups, where none were asked for, the same machine and nothing.

    Only the rows that the identification will fit are asked: what it holds out stays unseen. Raises ModelError for an unknown group."""
    arm = opened.arm
    if arm is None or not (names or arm.chain.groups):
        return opened, {}
    from robocal.arms.groups import rule_of
    from robocal.files.group_block import plain_options
    from robocal.prove.nongeometric.group_choice import choose_groups

    there = {g.name for g in arm.chain.groups}
    extra: dict[str, dict[str, Any]] = {rule_of(n).name: {} for n in names if n not in there}
    share, folds = options.hold_out, options.folds
    if share is None:
        share, folds = default_hold_out(data, folds)
    split = make_split(data, share, folds=folds, blocks=options.blocks, seed=options.seed)
    if len(split) and folds is None:
        data = data.take(split.configurations(0)[0])
    choice = choose_groups(arm.chain, data, extra, options, watch)
    tried = []
    for t in choice.tried:
        orders = {j: list(o) for j, o in t.orders}
        tried.append(to_display(files.GroupTried, t, reason=str(t.reason), code=t.reason.code, orders=orders))
    beyond = [files.NongeometricGroup(name=g.name, options=plain_options(g.options)) for g in choice.model.groups]
    return opened.with_machine(choice.model), {"groups_tried": tried, "beyond": beyond}


def beside(
    opened: Opened[Any], data: DataSet, found: Identification[Any], o: Any, solved: tuple[Options, float], watch: Watch | None
) -> tuple[Layer | None, dict[str, Any], dict[str, list[Any]]]:  # fmt: skip
    """The residual layer on top of an identification and what a result says beside it, where the options of the verb ask for them: the
    layer, and the methods side by side, in mm or deg; and the columns of comparison.csv. `solved` are the options and seconds of the
    identification."""
    more: dict[str, Any] = {}
    columns: dict[str, list[Any]] = {}
    methods = methods_of(o.compare, o.method)
    if methods or o.two_stages:
        from robocal.prove.compare import compare
        from robocal.session.compared_rows import comparison_columns

        known = (found, solved[1])
        compared = compare(opened.machine, data, methods or (o.method,), solved[0], known=known, watch=watch)
        columns = comparison_columns(compared) if methods else {}
        if o.two_stages:
            way = _two_stages(opened, data, found, solved[0], watch)
            compared = dataclasses.replace(compared, methods=(*compared.methods, way))
        more["comparison"] = to_display(files.Comparison, compared)
    if not o.layer:
        return None, more, columns
    guarded = guard_layer(found, data, watch)
    reason, points = guarded.reason, 0 if guarded.layer is None else len(guarded.layer.points)
    said = {"reason": str(reason), "code": reason.code, "used": guarded.layer is not None, "n": guarded.rows}
    more["layer"] = to_display(files.LayerSummary, guarded, points=points, **said)
    return guarded.layer, more, columns


def _two_stages(
    opened: Opened[Any], data: DataSet, found: Identification[Any], options: Options, watch: Watch | None
) -> MethodEntry:
    """The way in two stages, on the split of an identification; why it failed, where it did."""
    from robocal.prove.compare import MethodEntry, entry_beside
    from robocal.session.two_stages import identify_in_stages

    title, timed = "a map of the markers from images alone, then the robot with that map", Timed()
    try:
        made = identify_in_stages(opened.machine, data, dataclasses.replace(options, bootstrap=None), watch)
    except ModelError as error:
        return MethodEntry(TWO_STAGES, title, failed=str(error))
    return entry_beside(TWO_STAGES, title, made, found, timed.seconds)


def guard_layer(found: Identification[Chain], data: DataSet, watch: Watch | None = None) -> Guarded:
    """Asks whether a residual layer helps on top of an identification to these data."""
    from robocal.prove.nongeometric.layer import try_layer

    noisy = apply_noise(data, {(g.name, g.unit): g.tau for g in found.groups if g.tau > 0})
    made = build(found.nominal, noisy, free=found.correlation_names)
    return try_layer(found.nominal, noisy, made, made.with_table(found.table).start, watch)


def methods_of(words: str | None, chosen: str) -> tuple[str, ...]:
    """The methods of `--compare`: all that are worth it, or those named, the chosen one first where it is among them.
    Raises ModelError for an unknown name."""
    if words is None:
        return ()
    from robocal.prove.compare import DEFAULT

    named = DEFAULT if words == "all" else tuple(w.strip() for w in words.split(",") if w.strip())
    if not named:
        raise ModelError("no method is named", key="--compare", found=words, expected=", ".join(ESTIMATORS))
    for name in named:
        estimator(name)
    return tuple(dict.fromkeys((chosen, *named)))
