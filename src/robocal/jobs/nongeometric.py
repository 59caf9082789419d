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
from robocal.files import evidence as files
from robocal.files.groups import plain_options
from robocal.files.robot import Robot
from robocal.files.shown import shown
from robocal.jobs.watching import Watch
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet

if TYPE_CHECKING:
    from robocal.calibrate.nongeometric.groups import Tried
    from robocal.calibrate.nongeometric.layered import Guarded

__all__ = ["group_results", "guard_layer", "layer_result", "select_groups"]


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
        data = data.take(split.configurations(0)[0])
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
    told = [
        shown(files.GroupTried, t, reason=str(t.reason), code=t.reason.code, orders={j: list(o) for j, o in t.orders})
        for t in tried
    ]
    beyond = [files.Beyond(name=g.name, options=plain_options(g.options)) for g in robot.chain.groups]
    return {"groups_tried": told, "beyond": beyond}


def layer_result(found: Guarded | None) -> files.LayerSummary | None:
    """The residual layer of a result, in mm."""
    if found is None:
        return None
    points = 0 if found.layer is None else len(found.layer.points)
    said: dict[str, Any] = {"reason": str(found.reason), "code": found.reason.code}
    return shown(files.LayerSummary, found, used=found.layer is not None, n=found.rows, points=points, **said)
