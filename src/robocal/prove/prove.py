"""What unseen measurements prove: hold-out, k-fold and leave-one-out of one identification.

A round of a hold-out is done from the beginning (`trial`): start, noise and selection know its fitted configurations only. Of many
rows frames begin where all of them have these, as far as the fitted ones see the same of them: the same valley, found once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Bools, Ints
from robocal.diagnose.check_registry import Context
from robocal.diagnose.gross import neither, set_aside
from robocal.diagnose.limits import HOLD_OUT_PLACES, LEAVE_ONE_OUT_PLACES
from robocal.estimate.problem import Problem
from robocal.fit.baseline import Baseline, check_baseline, fit_baseline, frame_names, renew_baseline
from robocal.fit.estimators import can_batch, estimator
from robocal.fit.fit import Fit, fit, search_poses_again
from robocal.fit.free_poses import own_poses
from robocal.fit.misfit import by_unit
from robocal.fit.options import Options
from robocal.fit.pose_search import search_costly_poses
from robocal.fit.starts.own import place_configurations
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.progress import Watch, tell
from robocal.prove import folds
from robocal.prove.judge import Proof, Proven, units_of
from robocal.prove.split import Split, leave_one_out_rounds
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["Trial", "fit_beside_baseline", "prove", "trial"]


def prove(context: Context[Model], data: DataSet, split: Split) -> Proven:
    """Makes every proof that was asked for or is cheap; the baseline and the fit of the context are fitted to all `data` but the
    gross rows."""
    options, watch, base, whole = context.chosen, context.watch, context.need_baseline, context.need_fit
    count = len(np.unique(context.places))
    proofs: dict[str, Callable[[], Proof]] = {}
    if options.folds is not None:
        tell(watch, "folds", configurations=len(split))
        k_fold = _rounds(context, data, split, can_batch(options) and not options.reselect)
        proofs["k_fold"] = lambda: k_fold
    # By itself where it is one batch, or where nothing else proves anything; who asks for it gets it from any method, by
    # refits.
    blind = estimator(options.method).blind
    cheap = options.folds is None and (
        count <= LEAVE_ONE_OUT_PLACES if can_batch(options) else count < HOLD_OUT_PLACES and not blind
    )
    if (cheap if options.leave_one_out is None else options.leave_one_out) and count > 2:

        @cache
        def one_by_one() -> Proof:
            tell(watch, "leave-one-out", configurations=count)
            return _rounds(context, data, leave_one_out_rounds(data), can_batch(options))

        proofs["leave_one_out"] = one_by_one
    missed = "leave_one_out" not in proofs and not can_batch(options) and options.leave_one_out is None
    left_out = (Remark.of(Code.LEAVE_ONE_OUT_LEFT),) if missed and not blind and options.folds is None else ()
    if options.folds is not None or not len(split):
        everyone = np.arange(len(data.configurations))
        return Proven(proofs, base, whole, everyone, everyone[:0], everyone[:0], left_out)
    one = trial(context, data, split, 0)
    held_out = Proof(split, one.before, one.after, _units(base.problem, one.aside))
    proofs["held_out"] = lambda: held_out
    embargoed = np.flatnonzero(~(split.fit[0] | split.held_out[0]))
    return Proven(proofs, one.base, one.part, *split.configurations(0), embargoed, left_out)


def _in_batch(context: Context[Model], split: Split) -> Proof:
    """Every round of a split with the columns and the noise of the fit to everything."""
    base, whole = context.need_baseline, context.need_fit
    told, local = units_of(base.problem), folds.local_names(context.model, base.problem)
    frames = tuple(n for n in frame_names(context.model, base.problem) if n in whole.problem.free)
    known = [n for n in local if n in whole.problem.free]
    before = folds.unseen(base.problem.with_free(frames), base.x, split, told, known)
    after = folds.unseen(whole.problem, whole.solution.x, split, told, known, before.x)
    # Rows that the fit to everything does not use prove nothing where the baseline does not come near them either.
    aside = tuple(~t.used for t in whole.problem.terms)
    if any(a.any() for a in aside):
        clean = context.need_data
        apart = neither(context.model, clean, base, whole, np.arange(len(clean.configurations)))
        aside = tuple(a & u for a, u in zip(apart, aside, strict=True))
    return Proof(split, before, after, _units(base.problem, aside))


def _units(problem: Problem, aside: Sequence[Bools]) -> dict[str, Bools]:
    return {unit: by_unit(problem.terms, aside, unit) for unit in units_of(problem)}


def _rounds(context: Context[Model], data: DataSet, split: Split, quick: bool) -> Proof:
    """The rounds of a split: `quick` as one batch, else each from the beginning."""
    if quick:
        return _in_batch(context, split)
    trials = [trial(context, data, split, k) for k in range(len(split))]
    aside = tuple(np.any(a, axis=0) for a in zip(*(t.aside for t in trials), strict=True))
    finite = estimator(context.chosen.method).finite
    ended = all(t.part.solution.reasons[0].converged or finite for t in trials)
    before, after = folds.merge([t.before for t in trials]), folds.merge([t.after for t in trials])
    after = replace(after, converged=after.converged and ended)
    return Proof(split, before, after, _units(context.need_baseline.problem, aside))


@record
class Trial:
    """Baseline and identified model as the fitted configurations of one round know them, with what they miss elsewhere."""

    base: Baseline
    part: Fit
    aside: tuple[Bools, ...]  # held-out rows of every term that neither model comes near
    before: folds.Unseen
    after: folds.Unseen


def fit_beside_baseline(
    model: Model, data: DataSet, configurations: Ints, options: Options, watch: Watch | None
) -> tuple[DataSet, Array, Fit, Baseline]:
    """A fit to some configurations from the beginning: the data with gross rows marked, where the fit starts, x (1, P), the fit, and
    the baseline."""
    # Gross rows are looked for among the rows that are fitted: the others are not known here.
    there = model.with_values(options.begin) if options.begin else model
    clean, by = set_aside(there, data, configurations, watch), (options.loss, options.tuning)
    begun = fit_baseline(model, clean, configurations, *by, watch)
    near = fit_baseline(there, clean, configurations, *by, watch) if options.begin else begun
    start = search_poses_again(near.problem, near.x)
    found = fit(model, clean, configurations, options, start, watch)
    # The baseline deserves the same noise: with unstated or far too small sigmas a few rows or the angles would rule it.
    return clean, start, found, renew_baseline(model, (clean, begun), found.data, configurations, *by)


def trial(context: Context[Model], data: DataSet, split: Split, k: int) -> Trial:
    """One round done from the beginning: start, noise and selection know its fitted configurations only. Frames that they cannot see
    are looked for where the baseline of the context has them."""
    model, everything = context.model, context.need_baseline
    fitted, held = split.configurations(k)
    one = Split(split.held_out[k : k + 1], split.fit[k : k + 1], split.names[k : k + 1], split.how)
    clean, _, part, known = fit_beside_baseline(model, data, fitted, context.chosen, context.watch)
    known = check_baseline(model, known, everything.x)
    local = folds.local_names(model, known.problem)
    # Rows of a frame that nobody fitted (a new placement) are near nothing yet: they are profiled, and counted.
    ((names, _),) = folds.alike(known.problem, one, local)
    known_to_fit = np.ones(len(known.problem.terms), dtype=bool)
    if names:
        known_to_fit = np.asarray(~folds.terms_of(known.problem, names)[0].any(axis=0))
    if known.problem.blocks:
        # What nobody fitted has no place yet: it is placed by its own rows before anything is said of them.
        # From where the identified machine has it as well: one that is decimetres off may have it upside down.
        ended = zip(part.problem.table.names, map(float, part.solution.x[0]), strict=False)
        better = model.with_values({n: v for n, v in ended if n in model.table})
        unplaced = replace(clean, configurations=replace(clean.configurations, start=None))
        other = place_configurations(better, unplaced).configurations.start
        # A frame that nobody fitted says nothing of it. One that ends in a wrong valley all the same makes good rows look gross.
        placed = []
        for made, there in ((known.problem, known.x), (part.problem, part.solution.x)):
            seen = made.without([np.full(len(t.used), not k) for t, k in zip(made.terms, known_to_fit, strict=True)])
            placed.append(search_costly_poses(seen, own_poses(seen, there, one.held_out, other)[0], one.held_out[0]))
        known, posed = replace(known, x=placed[0]), placed[1]
        part = replace(part, solution=replace(part.solution, x=posed))
    base, base_x = known.problem, known.x
    aside = neither(model, clean, known, part, fitted)
    judged = zip(aside, base.terms, known_to_fit, strict=True)
    aside = tuple(a & np.isin(t.configuration, held) & k for a, t, k in judged)
    base, part = base.without(aside), replace(part, problem=part.problem.without(aside))
    x, solved = np.array(base_x), np.array(part.solution.x)
    before = after = np.ones(len(base.terms))
    if names:
        at = [base.table.index[n] for n in names]
        x[:, at] = solved[:, at] = everything.x[:, at]
        x[0], before = folds.profile(base, x, one.held_out[0], names)
        solved[0], after = folds.profile(part.problem, solved, one.held_out[0], names)
    mine: list[Array | None] = [None, None]
    if base.blocks:
        x, mine[0], _ = own_poses(base, x, one.held_out)
        solved, mine[1], _ = own_poses(part.problem, solved, one.held_out)
    part = replace(part, solution=replace(part.solution, x=solved))
    found, told = [], np.ones((1, len(base.terms)))
    frames, profiled = base.with_free([n for n in local if n not in names]), np.array([bool(names or base.blocks)])
    folds.proves_nothing(base.with_weights(None), base_x, frames, frames.normal(base_x).a, frames.free, told)
    for made, there, factor, own in ((base, x, before, mine[0]), (part.problem, solved, after, mine[1])):
        values = folds.empty(made, there, units_of(everything.problem))
        folds.collect(values, made, there, factor * told, one, np.zeros(1, dtype=np.int64), own)
        found.append(folds.Unseen(values, profiled, converged=known.converged))
    return Trial(Baseline(base, x, known.converged), part, aside, *found)
