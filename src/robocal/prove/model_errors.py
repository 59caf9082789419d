"""Errors of a model as it is: its own parameters fixed, frames of instruments fitted."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from robocal._record import field, record
from robocal._types import Array, Ints
from robocal.estimate.choosing.choice import choose
from robocal.fit.baseline import fit_baseline, frame_names
from robocal.fit.free_poses import own_poses
from robocal.fit.misfit import errors
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.progress import Watch

__all__ = ["Errors", "model_errors", "tool_names"]


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
    posed: bool = False  # whether the poses of configurations were fitted too
    converged: bool = True  # whether that fit came to its end

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
    return Errors(position, position_at, angle, fitted, rows, values, bool(problem.blocks), made.converged)
