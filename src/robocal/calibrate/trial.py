"""One round of a split done from the beginning: start, noise and selection know its fitted configurations only."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from robocal.calibrate.baseline import known_baseline, renoised
from robocal.calibrate.fit import Fit, fit, posed_again
from robocal.calibrate.folds import Unseen, alike, collect, empty, local_names, profile, proves_nothing, terms_of
from robocal.calibrate.gross import neither, set_aside
from robocal.calibrate.options import Options
from robocal.calibrate.poses import own_poses
from robocal.calibrate.split import Split
from robocal.calibrate.starts.own import placed
from robocal.estimate.problem import Problem
from robocal.measure.data import DataSet
from robocal.measure.machine import Machine

__all__ = ["Trial", "trial"]

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Watch = Callable[[dict[str, object]], None]


@dataclass(frozen=True)
class Trial:
    """Baseline and identified model as the fitted configurations of one round know them, with what they miss elsewhere."""

    base: Problem
    base_x: Array
    part: Fit
    aside: tuple[Bools, ...]  # held-out rows of every term that neither model comes near
    before: Unseen
    after: Unseen


def trial(
    model: Machine,
    data: DataSet,
    split: Split,
    k: int,
    options: Options,
    units: Sequence[str],
    start: Array,
    watch: Watch | None = None,
) -> Trial:
    """One round done from the beginning: start, noise and selection know its fitted configurations only. `start` (1, P) is where
    frames that they cannot see are looked for."""
    fitted, held = split.configurations(k)
    one = Split(split.held[k : k + 1], split.fit[k : k + 1], split.names[k : k + 1], split.how)
    # Gross rows are looked for among the rows that are fitted: the others are not known here.
    clean = set_aside(model, data, fitted, watch)
    by = (options.loss, options.tuning)
    begun = known_baseline(model, clean, fitted, *by, watch)
    part = fit(model, clean, fitted, options, posed_again(begun.problem, begun.x), watch)
    # The baseline deserves the same noise: with unstated or far too small sigmas a few rows or the angles would rule it.
    known = renoised(model, (clean, begun), part.data, fitted, *by)
    if known.problem.blocks:
        # What nobody fitted has no place yet: it is placed by its own rows before anything is said of them.
        # From where the identified machine has it as well: one that is decimetres off may have it upside down.
        names = part.problem.table.names
        ended = zip(names, map(float, part.solution.x[0]), strict=False)
        better = model.with_values({n: v for n, v in ended if n in model.table})
        other = placed(
            better, replace(clean, configurations=replace(clean.configurations, start=None))
        ).configurations.start
        known = replace(known, x=own_poses(known.problem, known.x, one.held, other)[0])
        part = replace(
            part, solution=replace(part.solution, x=own_poses(part.problem, part.solution.x, one.held, other)[0])
        )
    base, base_x = known.problem, known.x
    aside = neither(model, clean, known, part, fitted)
    local = local_names(model, base)
    # Rows of a frame that nobody fitted (a new placement) are near nothing yet: they are profiled, and counted.
    new = {n for names, rounds in alike(base, one, local) if len(rounds) for n in names}
    known_to_fit = np.asarray(~terms_of(base, sorted(new))[0].any(axis=0))
    judged = zip(aside, base.terms, known_to_fit, strict=True)
    aside = tuple(a & np.isin(t.configuration, held) & k for a, t, k in judged)
    base, part = base.without(aside), replace(part, problem=part.problem.without(aside))
    x, solved = np.array(base_x), np.array(part.solution.x)
    for names, rounds in alike(base, one, local):
        if not len(rounds) or not names:
            continue
        at = [base.table.index[n] for n in names]
        x[:, at] = solved[:, at] = start[:, at]
        x[0], before = profile(base, x, one.held[0], names)
        solved[0], after = profile(part.problem, solved, one.held[0], names)
        profiled = np.ones(1, dtype=bool)
        break
    else:
        before = after = np.ones(len(base.terms))
        profiled = np.zeros(1, dtype=bool)
    mine: list[Array | None] = [None, None]
    if base.blocks:
        x, mine[0], _ = own_poses(base, x, one.held)
        solved, mine[1], _ = own_poses(part.problem, solved, one.held)
        profiled = np.ones(1, dtype=bool)
    part = replace(part, solution=replace(part.solution, x=solved))
    found, told = [], np.ones((1, len(base.terms)))
    frames = base.with_free([n for n in local if not (profiled.any() and n in names)])
    proves_nothing(base.with_weights(None), base_x, frames, frames.normal(base_x).a, frames.free, told)
    for made, there, factor, own in ((base, x, before, mine[0]), (part.problem, solved, after, mine[1])):
        values = empty(made, there, units)
        collect(values, made, there, factor * told, one, np.zeros(1, dtype=np.int64), own)
        found.append(Unseen(values, profiled, converged=known.converged))
    return Trial(base, x, part, aside, *found)
