"""What unseen measurements prove: hold-out, k-fold and leave-one-out of one identification."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from robocal.arms.chain import Chain
from robocal.calibrate.baseline import frame_names
from robocal.calibrate.estimators import batched, estimator
from robocal.calibrate.fit import Fit
from robocal.calibrate.folds import local_names, merge, trial, unseen
from robocal.calibrate.identification import Options
from robocal.calibrate.judge import Proof, units_of
from robocal.calibrate.split import Split, leave_one_out_rounds, places
from robocal.estimate.problem import Problem
from robocal.measure.data import DataSet
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["FEW", "Proven", "prove"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Watch = Callable[[dict[str, object]], None]
FEW = 25  # below this many configurations a held-out fifth proves little, and leave-one-out is cheap
MANY = 400  # above this, leave-one-out is not run unless asked for


@dataclass(frozen=True)
class Proven:
    """The proofs by name, with the baseline and the fit that had not seen what was held out."""

    proofs: Mapping[str, Proof]
    base: Problem
    base_x: Array
    part: Fit
    fit_units: Ints
    held: Ints
    embargoed: Ints  # neither fitted nor held out
    left_out: tuple[Remark, ...]  # a proof that was not made

    @property
    def best(self) -> Proof | None:
        """The proof that the verdict takes."""
        return next((self.proofs[n] for n in ("held_out", "k_fold", "leave_one_out") if n in self.proofs), None)


def prove(
    model: Chain,
    data: DataSet,
    split: Split,
    options: Options,
    base: tuple[Problem, Array],
    whole: Fit,
    watch: Watch | None,
) -> Proven:
    """Makes every proof that was asked for or is cheap; `base` and `whole` are fitted to everything."""
    told = units_of(base[0])
    count = len(np.unique(places(data.configurations)))
    proofs: dict[str, Proof] = {}
    if options.folds is not None:
        if watch:
            watch({"stage": "folds", "units": len(split)})
        quick = batched(options) and not options.reselect
        proofs["k_fold"] = _rounds(model, data, base, whole, split, options, watch, quick)
    # By itself where it is one batch, or where nothing else proves anything; who asks for it gets it from any method, by
    # refits.
    blind = estimator(options.method).blind
    cheap = options.folds is None and (count <= MANY if batched(options) else count < FEW and not blind)
    if (cheap if options.leave_one_out is None else options.leave_one_out) and count > 2:
        if watch:
            watch({"stage": "leave-one-out", "units": count})
        rounds = leave_one_out_rounds(data)
        proofs["leave_one_out"] = _rounds(model, data, base, whole, rounds, options, watch, batched(options))
    missed = "leave_one_out" not in proofs and not batched(options) and options.leave_one_out is None
    left_out = (Remark.of(Code.LEAVE_ONE_OUT_LEFT),) if missed and not blind and options.folds is None else ()
    everyone = np.arange(len(data.configurations))
    if options.folds is not None or not len(split):
        return Proven(proofs, *base, whole, everyone, everyone[:0], everyone[:0], left_out)
    fit_units, held = split.units(0)
    one = trial(model, data, split, 0, options, told, base[1], watch)
    proofs["held_out"] = Proof(split, one.before, one.after)
    embargoed = np.flatnonzero(~(split.fit[0] | split.held[0]))
    return Proven(proofs, one.base, one.base_x, one.part, fit_units, held, embargoed, left_out)


def _in_batch(model: Chain, base: tuple[Problem, Array], whole: Fit, split: Split) -> Proof:
    """Every round of a split with the columns and the noise of the fit to everything."""
    problem, x = base
    told, local = units_of(problem), local_names(model, problem)
    frames = tuple(n for n in frame_names(model, problem) if n in whole.problem.free)
    known = [n for n in local if n in whole.problem.free]
    noisy = replace(whole.problem, free=frames)
    before = unseen(noisy, x, split, told, known)
    return Proof(split, before, unseen(whole.problem, whole.solution.x, split, told, known, before.x))


def _rounds(
    model: Chain,
    data: DataSet,
    base: tuple[Problem, Array],
    whole: Fit,
    split: Split,
    options: Options,
    watch: Watch | None,
    quick: bool,
) -> Proof:
    """The rounds of a split: `quick` as one batch, else each from the beginning."""
    if quick:
        return _in_batch(model, base, whole, split)
    trials = [trial(model, data, split, k, options, units_of(base[0]), base[1], watch) for k in range(len(split))]
    return Proof(split, merge([t.before for t in trials]), merge([t.after for t in trials]))
