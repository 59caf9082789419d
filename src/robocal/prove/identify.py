"""Identify a machine from its measurements, and judge the result.

1 decide   split, gross rows, baseline, fit, proof and verdict (see `decide`)
2 tell     the model that is handed back with covariance and prediction band, and what is worth knowing of it
3 offsets  the joints' zeros alone, proven on the same configurations, for controllers that take nothing else
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from robocal.diagnose.outliers import find_outliers
from robocal.diagnose.scatter import kept_rows
from robocal.errors import ModelError
from robocal.estimate.uncertainty import uncertainty
from robocal.fit.baseline import baseline, frame_names
from robocal.fit.estimators import batched, estimator
from robocal.fit.options import Options
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet
from robocal.measure.machine import Machine
from robocal.prove.bands import coverage_of, coverage_remarks, mean_conditions, measured_range
from robocal.prove.bootstrap import bootstrap_words, resample
from robocal.prove.decide import Decision, decide
from robocal.prove.identification import Identification
from robocal.prove.judge import stages, units_of
from robocal.prove.linear import linearity, linearity_words
from robocal.prove.offsets import offsets_alone
from robocal.prove.prove import FEW
from robocal.prove.region import where_it_holds
from robocal.prove.results import parameter_results, prediction_band, row_table
from robocal.prove.warn import data_warnings

__all__ = ["FEW", "baseline", "frame_names", "identify"]

M = TypeVar("M", bound=Machine)
Watch = Callable[[dict[str, object]], None]


def identify(model: M, data: DataSet, options: Options | None = None, watch: Watch | None = None) -> Identification[M]:
    """Identifies a model from data; see the module for the steps. Raises ModelError when nothing is free, nothing was
    measured, or a measurement is no number."""
    options = options or Options()
    if options.bootstrap is not None and not batched(options):
        words = "the bootstrap takes a method that minimises the cost"
        method = options.method if options.tolerance is None else f"{options.method}, which stops at a tolerance"
        raise ModelError(words, key="method", found=method, expected="lm")
    made = decide(model, data, options, watch)
    found = _handed_back(made, watch)
    return replace(found, offsets=offsets_alone(made.model, made.base.x, made.whole, made.proven, options.seed))


def _handed_back(made: Decision[M], watch: Watch | None) -> Identification[M]:
    """Everything that is told of what was decided."""
    model, data, options, whole, proven = made.model, made.data, made.options, made.whole, made.proven
    base, base_x, part, held = proven.base, proven.base_x, proven.part, proven.held
    told, best = units_of(base), proven.best
    u = whole.uncertainty
    if whole.covariance is not None:
        u = replace(u, covariance=whole.covariance)
    table = whole.problem.table.with_values(made.values)
    # The instrument's own bars: the same columns, weighed with the stated noise alone.
    stated = build(model, data).with_weights(whole.problem.weights).with_free(whole.problem.free)
    known = all(obs.sigma is not None for obs in data.observations)
    seen = max(whole, part, key=lambda f: f.problem.aside)
    strange = find_outliers(model, data, seen, {u: best.errors(u)[2] for u in told} if best else None)
    off, scale = made.off, made.scale
    bent = linearity(whole, made.start, u, told)
    holds = where_it_holds(model, data, whole, off, (base, base_x), options.region, scale, best.split if best else None)
    checked = coverage_of(part, held)
    results = parameter_results(model, whole, u, off, uncertainty(stated, whole.solution.x) if known else None)
    drawn = None if options.bootstrap is None else resample(whole, u.sigma, options.bootstrap, options.seed, watch)
    ids = data.configurations.ids
    return Identification(
        model,
        made.corrected,
        table,
        options,
        results,
        whole.identifiability,
        tuple(stages(data, base, base_x, part, proven.fitted, proven.proofs, unit) for unit in told),
        whole.groups,
        made.verdict(holds),
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
            *(q.remark for q in (made.held_number, made.late) if q and not q.wrong),
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
