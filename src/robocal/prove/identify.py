"""Identify a machine from its measurements, and judge the result.

1 decide   split, gross rows, baseline, fit, proof and verdict (see `decide`)
2 tell     the model that is handed back with covariance and prediction band, and what is worth knowing of it
3 offsets  the joints' zeros alone, proven on the same configurations, for controllers that take nothing else
"""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

from robocal.diagnose.check_registry import DIAGNOSE, PROVE, When, run
from robocal.diagnose.scale import common_scale
from robocal.diagnose.scatter import whiten_fit
from robocal.errors import ModelError
from robocal.estimate.uncertainty import uncertainty
from robocal.fit.baseline import baseline, frame_names
from robocal.fit.estimators import can_batch
from robocal.fit.options import Options
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.progress import Watch
from robocal.prove.bands import mean_conditions, range_of_joints
from robocal.prove.beside_verdict import linearity_of, outliers, unseen_coverage
from robocal.prove.bootstrap import bootstrap_of
from robocal.prove.decision import Decision, decide
from robocal.prove.identification import Identification
from robocal.prove.judge import stages, units_of
from robocal.prove.offsets import offsets_alone
from robocal.prove.region import range_of
from robocal.prove.results import parameter_results, prediction_of, row_table
from robocal.prove.verdict import verdict_of

__all__ = ["baseline", "frame_names", "identify"]

M = TypeVar("M", bound=Model)


def identify(model: M, data: DataSet, options: Options | None = None, watch: Watch | None = None) -> Identification[M]:
    """Identifies a model from data; see the module for the steps. Raises ModelError when nothing is free, nothing was
    measured, or a measurement is no number."""
    options = options or Options()
    if options.bootstrap is not None and not can_batch(options):
        words = "the bootstrap takes a method that minimises the cost"
        method = options.method if options.tolerance is None else f"{options.method}, which stops at a tolerance"
        raise ModelError(words, key="method", found=method, expected="lm")
    made = decide(model, data, options, watch)
    found = _build_identification(made, watch)
    return replace(
        found, offsets=offsets_alone(made.model, made.need_baseline.x, made.need_fit, made.need_proofs, options.seed)
    )


def _build_identification(made: Decision[M], watch: Watch | None) -> Identification[M]:
    """Everything that is told of what was decided."""
    model, data, options, whole, proven = made.model, made.need_data, made.chosen, made.need_fit, made.need_proofs
    base, base_x, part, held = proven.base, proven.base_x, proven.part, proven.held_out
    best, off = proven.best, whole.total
    u = whole.uncertainty
    if whole.covariance is not None:
        u = replace(u, covariance=whole.covariance)
    table = whole.problem.table.with_values(made.values)
    # The instrument's own bars: the same columns, weighed with the stated noise alone.
    stated = build(model, data).with_weights(whole.problem.weights).with_free(whole.problem.free)
    known = all(obs.sigma is not None for obs in data.observations)
    results = parameter_results(model, whole, u, off, uncertainty(stated, whole.solution.x) if known else None)
    findings = [f for when in (When.DATA, When.FIT) for f in run(when, made, DIAGNOSE, PROVE)]
    ids = data.configurations.ids
    return Identification(
        model,
        made.corrected,
        table,
        options,
        results,
        whole.identifiability,
        tuple(stages(data, base, base_x, part, proven.fitted, proven.proofs, unit) for unit in units_of(base)),
        whole.groups,
        verdict_of(made),
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
        prediction_of(made),
        tuple(findings),
        tuple(ids[i] for i in proven.embargoed),
        best.split.how if best else "",
        total=off,
        baseline=base.table.with_values(base_x[0, : len(base.table)]),
        coverage=unseen_coverage(made),
        joints=range_of_joints(data.configurations),
        linearity=linearity_of(made),
        outliers=outliers(made),
        conditions=mean_conditions(data.configurations),
        resampled=bootstrap_of(made),
        holds=range_of(made),
        scale=common_scale(made),
        whitened_rows=whiten_fit(made),
    )
