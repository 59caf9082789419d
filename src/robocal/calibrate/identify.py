"""Identify a machine from its measurements, and judge the result.

1 split    fit and held-out configurations, in one round or several
2 gross    rows that belong to no others are set aside (see `gross`)
3 start    closed form for frames and targets, refined together: the baseline
4 fit      what is seen above the noise, on the fit configurations (see `fit`)
5 judge    paired comparison with the baseline on configurations that were not used
6 refit    once more on everything, for the model that is handed back, with covariance and prediction band
7 offsets  the joints' zeros alone, proven on the same configurations, for controllers that take nothing else
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from robocal.calibrate.bands import coverage_of, coverage_remarks, mean_conditions, measured_range, total_of
from robocal.calibrate.baseline import baseline, frame_names, known_baseline, renoised
from robocal.calibrate.bootstrap import bootstrap_words, resample
from robocal.calibrate.estimators import batched, estimator
from robocal.calibrate.fit import Fit, fit, posed_again
from robocal.calibrate.gross import set_aside
from robocal.calibrate.identification import Identification
from robocal.calibrate.judge import stages, units_of, verdict
from robocal.calibrate.linear import linearity, linearity_words
from robocal.calibrate.motions import lacking
from robocal.calibrate.numbers import held_number, questioned
from robocal.calibrate.offsets import offsets_alone
from robocal.calibrate.options import Options
from robocal.calibrate.outliers import find_outliers
from robocal.calibrate.prove import FEW, Proven, prove
from robocal.calibrate.region import qualified, where_it_holds
from robocal.calibrate.results import parameter_results, prediction_band, row_table
from robocal.calibrate.scale import scale_of, scaled
from robocal.calibrate.scatter import kept_rows
from robocal.calibrate.segments.find import find_segments, refused_by
from robocal.calibrate.split import SHARE, make_split, places
from robocal.calibrate.starts.own import placed
from robocal.calibrate.warn import data_warnings
from robocal.calibrate.zeros import with_zeros
from robocal.errors import ModelError
from robocal.estimate.uncertainty import uncertainty
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet
from robocal.measure.machine import Machine

__all__ = ["FEW", "baseline", "frame_names", "identify"]

Array = NDArray[np.float64]
M = TypeVar("M", bound=Machine)
Watch = Callable[[dict[str, object]], None]


def identify(model: M, data: DataSet, options: Options | None = None, watch: Watch | None = None) -> Identification[M]:
    """Identifies a model from data; see the module for the steps. Raises ModelError when nothing is free, nothing was
    measured, or a measurement is no number."""
    options = options or Options()
    if options.bootstrap is not None and not batched(options):
        words = "the bootstrap takes a method that minimises the cost"
        raise ModelError(words, key="method", found=options.method, expected="lm")
    if not data.observations or not len(data.configurations):
        raise ModelError("the data set holds no measurement")
    _numbers(data)
    data = placed(model, data)
    count = len(np.unique(places(data.configurations)))
    if options.hold_out is None:
        options = replace(options, hold_out=SHARE if count >= FEW and options.folds is None else 0.0)
    assert options.hold_out is not None
    split = make_split(data, options.hold_out, folds=options.folds, blocks=options.blocks, seed=options.seed)
    everyone = np.arange(len(data.configurations))
    clean, by = set_aside(model, data, everyone, watch), (options.loss, options.tuning)
    begun = known_baseline(model, clean, everyone, *by, watch)
    start = posed_again(begun.problem, begun.x)
    whole = fit(model, clean, everyone, options, start, watch)
    if (likelier := with_zeros(model, whole)) is not None:
        return identify(likelier, data, options, watch)
    # The baseline deserves the same noise: with unstated or far too small sigmas a few rows or the angles would rule it.
    base = renoised(model, (clean, begun), whole.data, everyone, *by)
    proven = prove(model, data, clean, split, options, base, whole, watch)
    found: Identification[M] = _handed_back(model, clean, options, start, whole, proven, base.converged, watch)
    return replace(found, offsets=offsets_alone(model, base.x, whole, proven, options.seed))


def _handed_back(
    model: M,
    data: DataSet,
    options: Options,
    start: Array,
    whole: Fit,
    proven: Proven,
    started: bool,
    watch: Watch | None,
) -> Identification[M]:
    """Everything that is told of a fit to all measurements but gross rows, which `data` marks, and of what was proven."""
    base, base_x, part, held = proven.base, proven.base_x, proven.part, proven.held
    told, best = units_of(base), proven.best
    u = whole.uncertainty
    if whole.covariance is not None:
        u = replace(u, covariance=whole.covariance)
    values = whole.solution.x[0]
    names = whole.problem.table.names
    table = whole.problem.table.with_values(values[: len(names)])
    corrected = model.with_values({n: float(v) for n, v in zip(names, values, strict=False) if n in model.table})
    # The instrument's own bars: the same columns, weighed with the stated noise alone.
    stated = build(model, data).with_weights(whole.problem.weights).with_free(whole.problem.free)
    known = all(obs.sigma is not None for obs in data.observations)
    off, strange = (
        total_of(whole),
        find_outliers(
            model,
            data,
            max(whole, part, key=lambda f: f.problem.aside),
            {u: best.errors(u)[2] for u in told} if best else None,
        ),
    )
    moved = find_segments(model, data, dict(zip(names, map(float, values), strict=False)))
    bent = linearity(whole, start, u, told)
    scale = scale_of(model, whole, off)
    held_at = held_number(model, whole)
    holds = where_it_holds(model, data, whole, off, (base, base_x), options.region, scale)
    judged = verdict(model, data, base, part, whole, proven.proofs, options, started)
    if (few := lacking(model, whole)) is not None:
        judged = judged.refused(few)
    checked = coverage_of(part, held)
    results = parameter_results(model, whole, u, off, uncertainty(stated, whole.solution.x) if known else None)
    drawn = None if options.bootstrap is None else resample(whole, u.sigma, options.bootstrap, options.seed, watch)
    ids = data.configurations.ids
    return Identification(
        model,
        corrected,
        table,
        options,
        results,
        whole.identifiability,
        tuple(stages(data, base, base_x, part, proven.fitted, proven.proofs, unit) for unit in told),
        whole.groups,
        refused_by(moved, qualified(questioned(scaled(judged, scale), held_at), holds)),
        row_table(data, base, base_x, part, held, best.after.value if best else {}),
        tuple(ids[i] for i in proven.fitted),
        tuple(ids[i] for i in held),
        int(whole.solution.iterations[0]),
        whole.solution.reasons[0],
        tuple(float(c) for c in whole.solution.history[:, 0]),
        u.chi2,
        u.dof,
        whole.problem.free,
        u.correlation,
        u.covariance * u.factor**2,
        prediction_band(model, data, whole, off, options.region),
        (
            *data_warnings(model, data, whole, proven.fitted, options.method, strange),
            *linearity_words(bent),
            *bootstrap_words(drawn),
            *(scale.remarks if scale and not scale.beyond else ()),
            *((held_at.remark,) if held_at and not held_at.wrong else ()),
            *(() if estimator(options.method).blind else coverage_remarks(part, held, checked)),
            *proven.left_out,
        ),
        tuple(ids[i] for i in proven.embargoed),
        best.split.how if best else "",
        total=off,
        baseline=base.table.with_values(base_x[0, : len(base.table)]),
        coverage=checked,
        joints=measured_range(data.configurations),
        linearity=bent,
        outliers=strange,
        conditions=mean_conditions(data.configurations),
        resampled=drawn,
        holds=holds,
        scale=scale,
        kept=kept_rows(whole, off),
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
