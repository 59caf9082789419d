"""From the starts of every instrument to the best one for all of them."""

from __future__ import annotations

from importlib import import_module

import numpy as np

from robocal._types import Array, Ints
from robocal.estimate.least_squares import CROWD, least_squares
from robocal.estimate.problem import Problem
from robocal.fit.starts.target_rows import STARTS, Start, TargetRows
from robocal.measure.data import DataSet, Observations
from robocal.measure.machine import Model
from robocal.measure.reach import nominal_poses, place_is_known

__all__ = ["analytic_starts", "combine_starts", "refine"]

FEWEST = 3
ENOUGH = 1000  # rows of an instrument for where it stands: the refinement takes all
MOST = 32  # combinations that are worth a refinement
APART = 1e-6  # of the cost: so well it need be known of each of a crowd of starts which leads to the lowest
# Of this package, in which starts are; no more of them are loaded than it takes.
MODULES = ("frames", "cameras", "places", "encoders", "image_planes")


def start_of(kind: str) -> Start | None:
    """The closed-form start of a kind, None where it has none."""
    for module in MODULES:
        if kind not in STARTS:
            import_module(f"robocal.fit.starts.{module}")
    return STARTS.get(kind)


def analytic_starts(model: Model, data: DataSet, obs: Observations, configurations: Ints) -> list[dict[str, float]]:
    """Starting values by name for what one instrument needs: its frame or place, its target, its own numbers; empty
    where nothing is free or nothing is known."""
    start = start_of(obs.kind)
    known = place_is_known(model, data.configurations) if start else None
    if start is None or known is None:
        return []
    usable = np.zeros(len(known), dtype=bool)
    usable[configurations] = known[configurations]
    chosen = usable[obs.configuration] if obs.second is None else usable[obs.configuration] & usable[obs.second]
    index = np.flatnonzero(chosen if obs.used is None else chosen & obs.used)
    target = None
    if obs.targets and len(index):
        # The most frequent target starts the frame; the others follow in the refinement.
        first = 0 if obs.target is None else int(np.bincount(obs.target[index]).argmax())
        target = obs.targets[first]
        index = index if obs.target is None else index[obs.target[index] == first]
    if len(index) < FEWEST:
        return []
    if len(index) > ENOUGH:
        index = index[np.linspace(0, len(index) - 1, ENOUGH).astype(np.int64)]
    value = obs.value[index] if obs.value.ndim == 2 else obs.value[0, index]
    one, two = obs.configuration[index], obs.configuration[:0] if obs.second is None else obs.second[index]
    met, at = np.unique(np.concatenate([one, two]), return_inverse=True)
    machine = nominal_poses(model, data.configurations.take(met))
    assert machine is not None
    other = None if obs.second is None else machine[at[len(one) :]]
    return start(TargetRows(model, obs, index, value, target, machine[at[: len(one)]], other))


def combine_starts(model: Model, data: DataSet, configurations: Ints, problem: Problem) -> list[dict[str, float]]:
    """Every combination of the instruments' starts; where there are many, those that fit best as they are. `problem`
    has the columns free that may be set."""
    out: list[dict[str, float]] = [{}]
    # What nothing holds costs the same without its columns.
    bare = problem if problem.has_prior.any() else problem.with_free(())
    for obs in data.observations:
        found = analytic_starts(model, data, obs, configurations) or [{}]
        out = [{**a, **b} for a in out for b in found]
        if len(out) > MOST:
            cost = bare.normal(_start_matrix(problem, out)).cost
            out = [out[i] for i in np.argsort(np.where(np.isfinite(cost), cost, np.inf), kind="stable")[:MOST]]
    return out


def _start_matrix(problem: Problem, starts: list[dict[str, float]]) -> Array:
    """x (B, P) of every start; a held component keeps its stated value."""
    x = np.repeat(problem.start, len(starts), axis=0)
    for row, values in zip(x, starts, strict=True):
        for name, value in values.items():
            if name in problem.free:
                row[problem.table.index[name]] = value
    return x


def refine(problem: Problem, frames: tuple[str, ...], starts: list[dict[str, float]]) -> tuple[Array, bool]:
    """The best x (1, P) after fitting frames and targets from every start at once, and whether that fit converged; the
    table's own values are one more start. What is free and not fitted stays where a start has it: the rest belongs to it."""
    if not frames and not problem.blocks:
        return problem.start, True
    free = problem.with_free(frames)
    x = _start_matrix(problem, [{}, *starts])
    if len(x) > CROWD:
        rough = least_squares(free, x, cost_tolerance=APART, rivals=True)
        x = rough.x[[_lowest(rough.cost)]]
    ended = least_squares(free, x, rivals=True)
    best = _lowest(ended.cost)
    return ended.x[[best]], ended.settled(best)


def _lowest(cost: Array) -> int:
    return int(np.argmin(np.where(np.isfinite(cost), cost, np.inf)))
