"""Identify a machine from its measurements, and judge the result.

1 start    closed form for frames and targets, refined together: the baseline
2 split    fit and held-out configurations
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
from robocal.calibrate import starts
from robocal.calibrate.evidence import Statistic, Verdict, constant_errors, errors, judge, leave_one_out
from robocal.calibrate.fit import Fit, fit, unit_weights
from robocal.calibrate.identification import Identification, Options, Stages
from robocal.calibrate.results import parameter_results, prediction_band, row_table
from robocal.calibrate.split import places, stratified
from robocal.calibrate.warn import data_warnings, implausible
from robocal.errors import ModelError
from robocal.estimate.identifiability import analyse
from robocal.estimate.problem import Problem
from robocal.estimate.uncertainty import uncertainty
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["baseline", "frame_names", "identify"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Watch = Callable[[dict[str, object]], None]
FEW = 25  # below this many configurations a held-out fifth proves little, and leave-one-out is cheap
UNITS = ("m", "rad", "px")  # in which errors are told; the verdict takes the first that was measured
BENT = 3e-3  # m per axis: what implausible changes may leave; an arm that is merely bad is explained better
MANY = 400  # above this, leave-one-out is not run unless asked for


def frame_names(model: Chain, problem: Problem) -> tuple[str, ...]:
    """The free parameters of the baseline: instruments' frames, targets, other kinds' parameters, and the tool."""
    tool = {f"tool.{s}" for s in FRAME_SYMBOLS}
    return tuple(n for n in problem.table.free if n not in model.table or n in tool)


def baseline(model: Chain, data: DataSet, units: Ints, watch: Watch | None = None) -> tuple[Problem, Array]:
    """The nominal model with frames and tool fitted to some units: the problem over all data (weights on those units)
    and x (1, P)."""
    made = build(model, data).with_weights(unit_weights(len(data.configurations), units))
    if watch:
        watch({"stage": "start"})
    candidates: list[dict[str, float]] = [{}]
    for obs in data.observations:
        found = starts.closed_form(model, data, obs, units)
        candidates = [{**a, **b} for a in candidates for b in (found or [{}])][:32]
    frames = frame_names(model, made)
    # What can be seen of the frames is asked where they are believed to stand, not at the table's zeros.
    there = made.with_table(made.table.with_values({n: v for n, v in candidates[0].items() if n in frames}))
    seen = analyse(there.with_free(frames), there.start) if frames else None
    return made, starts.refine(made, seen.kept if seen else (), [c for c in candidates if c])


def identify(model: Chain, data: DataSet, options: Options | None = None, watch: Watch | None = None) -> Identification:
    """Identifies a model from data; see the module for the steps. Raises ModelError when nothing is free or nothing
    was measured."""
    options = options or Options()
    if not data.observations or not len(data.configurations):
        raise ModelError("the data set holds no measurement")
    label = places(data.configurations)
    count = int(label.max()) + 1
    fraction = options.hold_out if options.hold_out is not None else (0.2 if count >= FEW else 0.0)
    fit_units, held = stratified(data.configurations, fraction, options.seed)
    everyone = np.arange(len(label))
    base_problem, base_x = baseline(model, data, fit_units, watch)
    part = fit(model, data, fit_units, options, base_x, watch)
    # The baseline deserves the same noise: with unstated or far too small sigmas a few rows or the angles would rule it.
    base_problem, base_x = baseline(model, part.data, fit_units)
    whole = part
    if len(held):
        _, all_x = baseline(model, data, everyone, watch)
        whole = fit(model, data, everyone, options, all_x, watch)
    wanted = options.leave_one_out if options.leave_one_out is not None else count <= MANY
    wanted = wanted and count > 2 and options.method in ("lm", "gauss-newton")
    loo = _leave_one_out(model, base_problem, base_x, whole, everyone, label, watch) if wanted else {}
    stages = tuple(
        s for u in UNITS if (s := _stages(data, base_problem, base_x, part, fit_units, held, loo, u)) is not None
    )
    verdict = _verdict(data, base_problem, base_x, part, fit_units, held, loo, options)
    if verdict.status == "improved":
        verdict = _second_thoughts(model, base_problem, part, bool(len(held)), verdict)
    u = uncertainty(whole.problem, whole.solution.x, estimated=any(g.stated is None for g in whole.groups))
    values = whole.solution.x[0]
    names = whole.problem.table.names
    table = whole.problem.table.with_values(values[: len(names)])
    corrected = model.with_values({n: float(v) for n, v in zip(names, values, strict=False) if n in model.table})
    # The instrument's own bars: the same columns, weighed with the stated noise alone.
    stated = build(model, data).with_weights(whole.problem.weights).with_free(whole.problem.free)
    known = all(obs.sigma is not None for obs in data.observations)
    results = parameter_results(model, whole, u, uncertainty(stated, whole.solution.x) if known else None)
    return Identification(
        model,
        corrected,
        table,
        replace(options, hold_out=fraction),
        results,
        whole.identifiability,
        stages,
        whole.groups,
        verdict,
        row_table(data, base_problem, base_x, part, held, loo.get("m")),
        tuple(data.configurations.ids[i] for i in fit_units),
        tuple(data.configurations.ids[i] for i in held),
        int(whole.solution.iterations[0]),
        whole.solution.reasons[0].text,
        tuple(float(c) for c in whole.solution.history[:, 0]),
        u.chi2,
        u.dof,
        whole.problem.free,
        u.correlation,
        u.covariance * u.factor**2,
        prediction_band(model, data, whole, u),
        data_warnings(model, data, whole, fit_units, options.method),
    )


def _leave_one_out(
    model: Chain, base: Problem, base_x: Array, whole: Fit, units: Ints, label: Ints, watch: Watch | None
) -> dict[str, tuple[Array, Array]]:
    """Errors (baseline, identified) with every configuration left out once, by unit."""
    if watch:
        watch({"stage": "leave-one-out", "units": len(units)})
    frames = tuple(n for n in frame_names(model, base) if n in whole.problem.free)
    noisy = replace(whole.problem, free=frames)
    out = {}
    for unit in UNITS:
        if any(u == unit for t in base.terms for _, _, u in t.parts):
            out[unit] = (
                leave_one_out(noisy, base_x, units, unit, label=label)
                if frames
                else errors(base.residuals(base_x), unit)[0],
                leave_one_out(whole.problem, whole.solution.x, units, unit, label=label),
            )
    return out


def _stages(
    data: DataSet,
    base: Problem,
    base_x: Array,
    part: Fit,
    fit_units: Ints,
    held: Ints,
    loo: dict[str, tuple[Array, Array]],
    unit: str,
) -> Stages | None:
    before, at = errors(base.residuals(base_x), unit)
    if not len(before):
        return None
    after, _ = errors(part.problem.residuals(part.solution.x), unit)
    inside, outside = np.isin(at, fit_units), np.isin(at, held)
    one = loo.get(unit)
    constant = _constant(data, fit_units, held) if unit == "m" else None
    return Stages(
        unit,
        Statistic.of(before[inside]),
        Statistic.of(after[inside]),
        Statistic.of(before[outside]),
        Statistic.of(after[outside]),
        Statistic.of(one[0]) if one else None,
        Statistic.of(one[1]) if one else None,
        Statistic.of(constant) if constant is not None else None,
    )


def _second_thoughts(model: Chain, base: Problem, part: Fit, held_out: bool, verdict: Verdict) -> Verdict:
    """An improvement that cannot be one: nothing of the robot was fitted, or leaving a configuration out leaves too
    little to fit."""
    problem = part.problem
    if not set(problem.free) - set(frame_names(model, base)):
        return Verdict("not_improved", ("nothing of the robot itself is seen in these data", *verdict.reasons))
    rows = sum(np.bincount(t.unit, minlength=problem.units) * t.scale.shape[1] for t in problem.terms)
    left, sought = int(np.sum(rows) - np.max(rows)), problem.n - int((problem.prior[1] > 0).sum())
    # What is left would be met exactly, and the left-out configuration by what was known of it before.
    if not held_out and left <= sought:
        words = f"too few measurements: without one configuration {left} numbers are left for {sought} parameters"
        return Verdict("not_improved", (words, *verdict.reasons))
    bent = implausible(model, part)
    left_over = max((g.rms for g in part.groups if g.unit == "m"), default=0.0)
    if bent and left_over > BENT:
        words = f"the model had to be bent and still leaves {left_over * 1e3:.3g} mm per axis"
        return Verdict("refused", (words, *bent, *verdict.reasons))
    return verdict


def _constant(data: DataSet, fit_units: Ints, held: Ints) -> Array | None:
    """What predicting the mean would miss, where positions were measured by one instrument; None otherwise."""
    found = [o for o in data.observations if o.kind in ("position", "pose")]
    if (
        len(found) != 1
        or found[0].value.ndim != 2
        or (found[0].target is not None and len(np.unique(found[0].target)) > 1)
    ):
        return None
    label = places(data.configurations)
    if len(np.unique(label)) < 2:
        return None
    return constant_errors(found[0].value[:, :3], label[found[0].configuration], label[fit_units], label[held])


def _verdict(
    data: DataSet,
    base: Problem,
    base_x: Array,
    part: Fit,
    fit_units: Ints,
    held: Ints,
    loo: dict[str, tuple[Array, Array]],
    options: Options,
) -> Verdict:
    if len(np.unique(places(data.configurations))) < 2:
        return Verdict("refused", ("all configurations are equal: this shows repeatability, not geometry",))
    unit = next(u for u in UNITS if any(u == v for t in base.terms for _, _, v in t.parts))
    before, at = errors(base.residuals(base_x), unit)
    after, _ = errors(part.problem.residuals(part.solution.x), unit)
    kind = "held out"
    chosen = np.isin(at, held)
    if not len(held):
        if unit not in loo:
            return Verdict("not_improved", ("nothing was held out, so nothing is proven",))
        before, after = loo[unit]
        chosen = np.ones(len(at), dtype=bool)
        kind = "leave-one-out"
    if not chosen.any():
        return Verdict("not_improved", ("no measurement was held out, so nothing is proven",))
    stated = [g.stated for g in part.groups if g.unit == "m" and g.stated is not None]
    return judge(
        before[chosen],
        after[chosen],
        _constant(data, fit_units, held) if unit == "m" else None,
        places(data.configurations)[at[chosen]],
        rank=part.identifiability.rank,
        # One step of linear least squares is all that was asked for.
        converged=part.solution.reasons[0].converged or options.method == "lse",
        seed=options.seed,
        kind=kind,
        stated=float(np.sqrt(3) * stated[0]) if stated else None,
        unit=unit,
    )
