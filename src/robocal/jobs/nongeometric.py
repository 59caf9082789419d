"""What an identification does beyond geometry: which groups enter, whether a residual layer helps, and how that is told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from robocal.arms.chain import Chain
from robocal.arms.groups import rule_of
from robocal.calibrate.identification import Identification
from robocal.calibrate.identify import FEW
from robocal.calibrate.noise import apply_noise
from robocal.calibrate.options import Options
from robocal.calibrate.split import SHARE, make_split, places
from robocal.files import nongeometric_parts as files
from robocal.files.groups import plain_options
from robocal.files.robot import Robot
from robocal.jobs.watching import Watch
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet

if TYPE_CHECKING:
    from robocal.calibrate.nongeometric.groups import Tried
    from robocal.calibrate.nongeometric.layered import Guarded

__all__ = ["group_results", "guard_layer", "layer_result", "select_groups"]

SHOWN = {"m": (1e3, "mm"), "rad": (180.0 / np.pi, "deg"), "px": (1.0, "px")}


def select_groups(
    robot: Robot, data: DataSet, names: Sequence[str], options: Options, watch: Watch | None = None
) -> tuple[Robot, tuple[Tried, ...]]:
    """The robot with the groups that the data support, asked of the rows that the identification will fit: what it
    holds out stays unseen. Raises ModelError for an unknown group."""
    there = {g.name for g in robot.chain.groups}
    extra: dict[str, dict[str, Any]] = {rule_of(n).name: {} for n in names if n not in there}
    if not extra and not there:
        return robot, ()
    from robocal.calibrate.nongeometric.groups import choose_groups

    share = options.hold_out
    if share is None:
        many = len(np.unique(places(data.configurations)))
        share = SHARE if many >= FEW and options.folds is None else 0.0
    split = make_split(data, share, folds=options.folds, blocks=options.blocks, seed=options.seed)
    if len(split) and options.folds is None:
        data = data.take(split.units(0)[0])
    choice = choose_groups(robot.chain, data, extra, options, watch)
    return replace(robot, chain=choice.model), choice.tried


def guard_layer(found: Identification[Chain], data: DataSet, watch: Watch | None = None) -> Guarded:
    """Asks whether a residual layer helps on top of an identification to these data."""
    from robocal.calibrate.nongeometric.layered import try_layer

    noisy = apply_noise(data, {(g.name, g.unit): g.tau for g in found.groups if g.tau > 0})
    made = build(found.nominal, noisy, free=found.correlation_names)
    return try_layer(found.nominal, noisy, made, made.with_table(found.table).start, watch)


def group_results(robot: Robot, tried: Sequence[Tried]) -> dict[str, Any]:
    """The groups of a result: what was tried, and what the robot has, so that it can be made again."""
    told = []
    for t in tried:
        factor, unit = SHOWN[t.unit]
        gain = None if t.gain is None else [v * factor for v in t.gain]
        told.append(
            files.GroupTried(
                name=t.name, parameters=t.parameters, entered=t.entered, reason=t.reason.sentence, code=t.reason.code, unit=unit,
                before=None if t.before is None else t.before * factor,
                gain=None if gain is None else files.Gain(mean=gain[0], low=gain[1], high=gain[2]),
                orders={joint: list(orders) for joint, orders in t.orders},
            )
        )  # fmt: skip
    beyond = [files.Beyond(name=g.name, options=plain_options(g.options)) for g in robot.chain.groups]
    return {"groups_tried": told, "beyond": beyond}


def layer_result(found: Guarded | None) -> files.LayerSummary | None:
    """The residual layer of a result, in mm."""
    if found is None:
        return None
    scaled = [None if v is None else v * 1e3 for v in (found.before, found.after, *(found.gain or (None,) * 3))]
    before, after, mean, low, high = scaled
    gain = None if mean is None else files.Gain(mean=mean, low=low, high=high)
    return files.LayerSummary(
        used=found.layer is not None, reason=found.reason.sentence, code=found.reason.code,
        before=before, after=after, gain=gain, n=found.rows,
        points=0 if found.layer is None else len(found.layer.points), coverage=found.coverage,
    )  # fmt: skip
