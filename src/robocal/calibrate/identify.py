"""Identify a machine from its measurements, and judge the result.

1 start    closed form for frames and targets, refined together: the baseline
2 split    fit and held-out configurations, in one round or several
3 fit      what is seen above the noise, on the fit configurations (see `fit`)
4 judge    paired comparison with the baseline on configurations that were not used
5 refit    once more on everything, for the model that is handed back, with covariance and prediction band
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from robocal.arms.chain import Chain
from robocal.calibrate.bands import coverage_of, mean_conditions, measured_range, total_of
from robocal.calibrate.baseline import baseline, frame_names
from robocal.calibrate.bootstrap import bootstrap_words, resample
from robocal.calibrate.estimators import batched, estimator
from robocal.calibrate.fit import Fit, fit
from robocal.calibrate.folds import local_names, merge, trial, unseen
from robocal.calibrate.identification import Identification, Options
from robocal.calibrate.judge import Proof, stages, units_of, verdict
from robocal.calibrate.linear import linearity, linearity_words
from robocal.calibrate.outliers import find_outliers
from robocal.calibrate.results import parameter_results, prediction_band, row_table
from robocal.calibrate.split import SHARE, Split, leave_one_out_rounds, make_split, places
from robocal.calibrate.warn import data_warnings
from robocal.errors import ModelError
from robocal.estimate.problem import Problem
from robocal.estimate.uncertainty import uncertainty
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet

__all__ = ["baseline", "frame_names", "identify"]

Array = NDArray[np.float64]
Watch = Callable[[dict[str, object]], None]
FEW = 25  # below this many configurations a held-out fifth proves little, and leave-one-out is cheap
MANY = 400  # above this, leave-one-out is not run unless asked for


def identify(model: Chain, data: DataSet, options: Options | None = None, watch: Watch | None = None) -> Identification:
    """Identifies a model from data; see the module for the steps. Raises ModelError when nothing is free, nothing was
    measured, or a measurement is no number."""
    options = options or Options()
    if not data.observations or not len(data.configurations):
        raise ModelError("the data set holds no measurement")
    _numbers(data)
    count = len(np.unique(places(data.configurations)))
    if options.hold_out is None:
        options = replace(options, hold_out=SHARE if count >= FEW and options.folds is None else 0.0)
    assert options.hold_out is not None
    split = make_split(data, options.hold_out, folds=options.folds, blocks=options.blocks, seed=options.seed)
    everyone = np.arange(len(data.configurations))
    _, start = baseline(model, data, everyone, watch)
    whole = fit(model, data, everyone, options, start, watch)
    # The baseline deserves the same noise: with unstated or far too small sigmas a few rows or the angles would rule it.
    base, base_x = baseline(model, whole.data, everyone)
    proofs, part, fit_units = {}, whole, everyone
    told = units_of(base)
    if options.folds is not None:
        if watch:
            watch({"stage": "folds", "units": len(split)})
        quick = batched(options) and not options.reselect
        proofs["k_fold"] = _rounds(model, data, (base, base_x), whole, split, options, watch, quick)
    # By itself where it is one batch, or where nothing else proves anything; who asks for it gets it from any method, by
    # refits.
    method = estimator(options.method)
    cheap = options.folds is None and (count <= MANY if batched(options) else count < FEW and not method.blind)
    if (cheap if options.leave_one_out is None else options.leave_one_out) and count > 2:
        if watch:
            watch({"stage": "leave-one-out", "units": count})
        rounds = leave_one_out_rounds(data)
        proofs["leave_one_out"] = _rounds(model, data, (base, base_x), whole, rounds, options, watch, batched(options))
    if options.folds is None and len(split):
        fit_units, held = split.units(0)
        one = trial(model, data, split, 0, options, told, base_x, watch)
        base, base_x, part = one.base, one.base_x, one.part
        proofs["held_out"] = Proof(split, one.before, one.after)
    else:
        held = everyone[:0]
    used = split.fit[0] | split.held[0] if len(held) else np.ones(len(everyone), dtype=bool)
    best = next((proofs[n] for n in ("held_out", "k_fold", "leave_one_out") if n in proofs), None)
    u = uncertainty(whole.problem, whole.solution.x, estimated=any(g.stated is None for g in whole.groups))
    if whole.covariance is not None:
        u = replace(u, covariance=whole.covariance)
    values = whole.solution.x[0]
    names = whole.problem.table.names
    table = whole.problem.table.with_values(values[: len(names)])
    corrected = model.with_values({n: float(v) for n, v in zip(names, values, strict=False) if n in model.table})
    # The instrument's own bars: the same columns, weighed with the stated noise alone.
    stated = build(model, data).with_weights(whole.problem.weights).with_free(whole.problem.free)
    known = all(obs.sigma is not None for obs in data.observations)
    off, strange = total_of(whole), find_outliers(data, whole)
    bent = linearity(whole, start, u, told)
    missed = "leave_one_out" not in proofs and not batched(options) and options.leave_one_out is None
    words = "leave-one-out was left out: this method takes a refit for every configuration (--leave-one-out does it)"
    left_out = (words,) if missed and not method.blind and options.folds is None else ()
    results = parameter_results(model, whole, u, off, uncertainty(stated, whole.solution.x) if known else None)
    drawn = None
    if options.bootstrap is not None:
        if not batched(options):
            raise ModelError(
                "the bootstrap takes a method that minimises the cost",
                key="method",
                found=options.method,
                expected="lm",
            )
        drawn = resample(whole, u.sigma, options.bootstrap, options.seed, watch)
    ids = data.configurations.ids
    return Identification(
        model,
        corrected,
        table,
        options,
        results,
        whole.identifiability,
        tuple(stages(data, base, base_x, part, fit_units, proofs, unit) for unit in told),
        whole.groups,
        verdict(model, data, base, part, whole, proofs, options),
        row_table(data, base, base_x, part, held, best.after.value if best else {}),
        tuple(ids[i] for i in fit_units),
        tuple(ids[i] for i in held),
        int(whole.solution.iterations[0]),
        whole.solution.reasons[0].text,
        tuple(float(c) for c in whole.solution.history[:, 0]),
        u.chi2,
        u.dof,
        whole.problem.free,
        u.correlation,
        u.covariance * u.factor**2,
        prediction_band(model, data, whole, off),
        (
            *data_warnings(model, data, whole, fit_units, options.method, strange),
            *linearity_words(bent),
            *bootstrap_words(drawn),
            *left_out,
        ),
        tuple(ids[i] for i in np.flatnonzero(~used)),
        best.split.how if best else "",
        total=off,
        baseline=base.table.with_values(base_x[0, : len(base.table)]),
        coverage=coverage_of(part, held),
        joints=measured_range(data.configurations),
        linearity=bent,
        outliers=strange,
        conditions=mean_conditions(data.configurations),
        resampled=drawn,
    )


def _numbers(data: DataSet) -> None:
    for obs in data.observations:
        for what, bad in (
            ("a measurement is not a finite number", ~np.isfinite(obs.value).all(axis=-1)),
            ("a sigma must be above zero", np.zeros(len(obs)) if obs.sigma is None else ~(obs.sigma > 0).all(axis=-1)),
        ):
            if bad.any():
                first = obs.configuration[np.flatnonzero(bad)[0]]
                raise ModelError(what, key=obs.label, found=f"configuration {data.configurations.ids[first]}")


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
