"""What unseen measurements prove: hold-out, k-fold and leave-one-out of one identification.

A round of a hold-out is done from the beginning (`trial`): start, noise and selection know its fitted configurations only.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.diagnose.gross import neither, set_aside
from robocal.diagnose.limits import HOLD_OUT_PLACES, LEAVE_ONE_OUT_PLACES
from robocal.estimate.problem import Problem
from robocal.fit.baseline import Baseline, fit_baseline, frame_names, renew_baseline
from robocal.fit.estimators import can_batch, estimator
from robocal.fit.fit import Fit, fit, search_poses_again
from robocal.fit.free_poses import own_poses
from robocal.fit.misfit import by_unit
from robocal.fit.options import Options
from robocal.fit.repeats import places
from robocal.fit.starts.own import place_configurations
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.progress import Watch
from robocal.prove.folds import (
    Unseen,
    alike,
    collect,
    empty,
    local_names,
    merge,
    profile,
    proves_nothing,
    terms_of,
    unseen,
)
from robocal.prove.judge import Proof, best, units_of
from robocal.prove.split import Split, leave_one_out_rounds
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["Proven", "Trial", "prove", "trial"]


class Proofs(Mapping[str, Proof]):
    """Proofs by name; one that others may make needless is made when it is asked for."""

    def __init__(self) -> None:
        self.made: dict[str, Proof] = {}
        self._later: dict[str, Callable[[], Proof]] = {}

    def later(self, name: str, make: Callable[[], Proof]) -> None:
        """Enters a proof that is made when somebody asks for it."""
        self._later[name] = make

    def __getitem__(self, name: str) -> Proof:
        if name not in self.made:
            self.made[name] = self._later[name]()
        return self.made[name]

    def __contains__(self, name: object) -> bool:
        return name in self.made or name in self._later

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys((*self._later, *self.made)))

    def __len__(self) -> int:
        return len({*self._later, *self.made})


@dataclass(frozen=True)
class Proven:
    """The proofs by name, with the baseline and the fit that had not seen what was held out."""

    proofs: Mapping[str, Proof]
    base: Problem
    base_x: Array
    part: Fit
    fitted: Ints
    held_out: Ints
    embargoed: Ints  # neither fitted nor held out
    left_out: tuple[Remark, ...]  # a proof that was not made

    @property
    def best(self) -> Proof | None:
        """The proof that the verdict takes."""
        return best(self.proofs)


def prove(
    model: Model,
    data: DataSet,
    clean: DataSet,
    split: Split,
    options: Options,
    base: Baseline,
    whole: Fit,
    watch: Watch | None,
) -> Proven:
    """Makes every proof that was asked for or is cheap; `base` and `whole` are fitted to the `clean` data, all of them but the
    gross rows."""
    told = units_of(base.problem)
    count = len(np.unique(places(data.configurations)))
    proofs = Proofs()
    if options.folds is not None:
        if watch:
            watch({"stage": "folds", "configurations": len(split)})
        quick = can_batch(options) and not options.reselect
        proofs.made["k_fold"] = _rounds(model, data, clean, base, whole, split, options, watch, quick)
    # By itself where it is one batch, or where nothing else proves anything; who asks for it gets it from any method, by
    # refits.
    blind = estimator(options.method).blind
    cheap = options.folds is None and (
        count <= LEAVE_ONE_OUT_PLACES if can_batch(options) else count < HOLD_OUT_PLACES and not blind
    )
    if (cheap if options.leave_one_out is None else options.leave_one_out) and count > 2:

        def one_by_one() -> Proof:
            if watch:
                watch({"stage": "leave-one-out", "configurations": count})
            rounds = leave_one_out_rounds(data)
            return _rounds(model, data, clean, base, whole, rounds, options, watch, can_batch(options))

        proofs.later("leave_one_out", one_by_one)
    missed = "leave_one_out" not in proofs and not can_batch(options) and options.leave_one_out is None
    left_out = (Remark.of(Code.LEAVE_ONE_OUT_LEFT),) if missed and not blind and options.folds is None else ()
    everyone = np.arange(len(data.configurations))
    if options.folds is not None or not len(split):
        return Proven(proofs, base.problem, base.x, whole, everyone, everyone[:0], everyone[:0], left_out)
    fitted, held = split.configurations(0)
    one = trial(model, data, split, 0, options, told, base.x, watch)
    proofs.made["held_out"] = Proof(split, one.before, one.after, _units(base.problem, one.aside))
    embargoed = np.flatnonzero(~(split.fit[0] | split.held_out[0]))
    return Proven(proofs, one.base, one.base_x, one.part, fitted, held, embargoed, left_out)


def _in_batch(model: Model, clean: DataSet, base: Baseline, whole: Fit, split: Split) -> Proof:
    """Every round of a split with the columns and the noise of the fit to everything."""
    problem, x = base.problem, base.x
    told, local = units_of(problem), local_names(model, problem)
    frames = tuple(n for n in frame_names(model, problem) if n in whole.problem.free)
    known = [n for n in local if n in whole.problem.free]
    before = unseen(problem.with_free(frames), x, split, told, known)
    after = unseen(whole.problem, whole.solution.x, split, told, known, before.x)
    return Proof(split, before, after, _units(problem, _never_near(model, clean, base, whole)))


def _never_near(model: Model, clean: DataSet, base: Baseline, whole: Fit) -> tuple[Bools, ...]:
    """Rows that the fit to everything does not use, and that the baseline does not come near either."""
    unused = tuple(~t.used for t in whole.problem.terms)
    if not any(u.any() for u in unused):
        return unused
    apart = neither(model, clean, base, whole, np.arange(len(clean.configurations)))
    return tuple(a & u for a, u in zip(apart, unused, strict=True))


def _units(problem: Problem, aside: Sequence[Bools]) -> dict[str, Bools]:
    return {unit: by_unit(problem.terms, aside, unit) for unit in units_of(problem)}


def _rounds(
    model: Model,
    data: DataSet,
    clean: DataSet,
    base: Baseline,
    whole: Fit,
    split: Split,
    options: Options,
    watch: Watch | None,
    quick: bool,
) -> Proof:
    """The rounds of a split: `quick` as one batch, else each from the beginning."""
    if quick:
        return _in_batch(model, clean, base, whole, split)
    told = units_of(base.problem)
    trials = [trial(model, data, split, k, options, told, base.x, watch) for k in range(len(split))]
    aside = tuple(np.any(a, axis=0) for a in zip(*(t.aside for t in trials), strict=True))
    ended = all(t.part.solution.reasons[0].converged or estimator(options.method).finite for t in trials)
    after = merge([t.after for t in trials])
    return Proof(
        split,
        merge([t.before for t in trials]),
        replace(after, converged=after.converged and ended),
        _units(base.problem, aside),
    )


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
    model: Model,
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
    one = Split(split.held_out[k : k + 1], split.fit[k : k + 1], split.names[k : k + 1], split.how)
    # Gross rows are looked for among the rows that are fitted: the others are not known here.
    clean = set_aside(model, data, fitted, watch)
    by = (options.loss, options.tuning)
    begun = fit_baseline(model, clean, fitted, *by, watch)
    part = fit(model, clean, fitted, options, search_poses_again(begun.problem, begun.x), watch)
    # The baseline deserves the same noise: with unstated or far too small sigmas a few rows or the angles would rule it.
    known = renew_baseline(model, (clean, begun), part.data, fitted, *by)
    if known.problem.blocks:
        # What nobody fitted has no place yet: it is placed by its own rows before anything is said of them.
        # From where the identified machine has it as well: one that is decimetres off may have it upside down.
        names = part.problem.table.names
        ended = zip(names, map(float, part.solution.x[0]), strict=False)
        better = model.with_values({n: v for n, v in ended if n in model.table})
        other = place_configurations(
            better, replace(clean, configurations=replace(clean.configurations, start=None))
        ).configurations.start
        known = replace(known, x=own_poses(known.problem, known.x, one.held_out, other)[0])
        part = replace(
            part, solution=replace(part.solution, x=own_poses(part.problem, part.solution.x, one.held_out, other)[0])
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
        x[0], before = profile(base, x, one.held_out[0], names)
        solved[0], after = profile(part.problem, solved, one.held_out[0], names)
        profiled = np.ones(1, dtype=bool)
        break
    else:
        before = after = np.ones(len(base.terms))
        profiled = np.zeros(1, dtype=bool)
    mine: list[Array | None] = [None, None]
    if base.blocks:
        x, mine[0], _ = own_poses(base, x, one.held_out)
        solved, mine[1], _ = own_poses(part.problem, solved, one.held_out)
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
