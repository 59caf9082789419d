"""Errors of a model as it is: its own parameters fixed, frames of instruments fitted."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from robocal._record import field, record, replace
from robocal._types import Array, Ints
from robocal.estimate.choosing.choice import choose
from robocal.fit.baseline import fit_baseline, frame_names
from robocal.fit.free_poses import own_poses
from robocal.fit.misfit import errors
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet, Frame, Observations
from robocal.measure.machine import Model
from robocal.measure.rows import Rows
from robocal.progress import Watch
from robocal.prove.lengths_alone import misses_of_lengths

__all__ = ["Errors", "model_errors", "tool_names", "tool_positions"]


@record
class Errors:
    """Errors of one model by SI unit: values (N,) with the configuration of each (N,), and the frame parameters that
    were fitted."""

    position: Array
    position_at: Ints
    angle: Array
    fitted: tuple[str, ...]
    rows: int
    values: Mapping[str, float] = field(default_factory=dict)  # of every parameter of the problem
    poses: Array | None = None  # frame vectors (U, 6) of configurations whose poses were fitted too
    converged: bool = True  # whether that fit came to its end
    torque: Array = field(default_factory=lambda: np.zeros(0))  # of joints (M,), N m
    from_lengths: tuple[Array, Array] = (np.zeros(0), np.zeros(0))  # of poses from lengths alone, m and rad

    @property
    def factor(self) -> float:
        """What fitting the frames took away from the errors."""
        left = self.rows - len(self.fitted)
        return float(np.sqrt(self.rows / left)) if left > 0 else float("inf")


def tool_names(*models: Model) -> tuple[str, ...]:
    """What of the tool is free in one of several models: that of which a file may say nothing."""
    return tuple(dict.fromkeys(n for m in models for n in m.table.free if n.startswith("tool.")))


def model_errors(
    model: Model, data: DataSet, watch: Watch | None = None, *, tool: bool | Collection[str] = False
) -> Errors:
    """Errors of a model with its own parameters fixed, frames of instruments fitted, and the poses that configurations have of their
    own, each to its rows; `tool`: what is free of its tool too, or these parameters of it."""
    wanted = tool_names(model) if tool is True else tool or ()
    fixed = model.with_table(model.table.with_free([n for n in wanted if n in model.table]))
    made = fit_baseline(fixed, data, np.arange(len(data.configurations)), watch=watch)
    problem, x = made.problem, made.x
    frames = frame_names(fixed, problem)
    fitted = choose(problem.with_free(frames), x).basis if frames else ()
    taken = np.ones((1, problem.configurations))
    if problem.blocks:
        x, taken, _ = own_poses(problem, x, np.ones((1, problem.configurations), dtype=bool))
    residuals = problem.residuals(x)
    (position, position_at), (angle, angle_at) = errors(residuals, "m"), errors(residuals, "rad")
    position, angle = position * taken[0, position_at], angle * taken[0, angle_at]
    rows = sum(r.value.size for r in residuals)
    values = dict(zip(problem.table.names, x[0].tolist(), strict=False))
    poses = x[0, problem.places[0]].reshape(-1, 6) if problem.blocks else None
    torque = errors(residuals, "N m")[0]
    alone = misses_of_lengths(problem, x)
    return Errors(position, position_at, angle, fitted, rows, values, poses, made.converged, torque, alone)


def tool_positions(model: Model, data: DataSet, found: Errors) -> Array:
    """Where a model has its tool, or its platform, at every configuration, in base coordinates (U, 3); not a number where nothing
    moves."""
    where, count = data.configurations, len(data.configurations)
    if model.mechanism is None:
        return np.full((count, 3), np.nan)
    if found.poses is not None:
        where = replace(where, start=found.poses)
    ideal = Observations("position", np.arange(count), np.zeros((count, 3)), np.ones((count, 3)), Frame("base frame"))
    made = build(model, DataSet(where, (ideal,)), values={n: v for n, v in found.values.items() if n in model.table})
    (term,) = made.terms
    assert isinstance(term, Rows)
    return term.predict(made.start)
