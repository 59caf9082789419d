"""Identify a machine from its measurements, and judge the result.

    1 start     closed form for frames and targets, refined           4 refit   once more on everything, for the model
    that is handed back
    2 split     fit and held-out configurations                       5 judge   paired comparison with the baseline on
    unseen configurations
    3 fit       what is seen, with the noise as fitted, in rounds     6 report  covariance, hidden combinations,
    prediction band

The noise decides what is seen, what is seen decides the fit, and the fit decides the noise: three rounds settle it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from robocal.arms.chain import Chain
from robocal.calibrate import starts
from robocal.calibrate.evidence import Statistic, Verdict, constant_errors, errors, judge, leave_one_out
from robocal.calibrate.identification import Identification, Options, Stages
from robocal.calibrate.noise import Group, apply_noise, assess
from robocal.calibrate.results import parameter_results, prediction_band, row_table
from robocal.calibrate.split import stratified
from robocal.calibrate.warn import data_warnings
from robocal.errors import ModelError
from robocal.estimate.identifiability import Identifiability, analyse
from robocal.estimate.least_squares import Solution, least_squares
from robocal.estimate.problem import Problem
from robocal.estimate.uncertainty import uncertainty
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["Fit", "baseline", "fit", "identify"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Watch = Callable[[dict[str, object]], None]
ROUNDS = 3
FEW = 25  # below this many configurations a held-out fifth proves little, and leave-one-out is cheap
MANY = 400  # above this, leave-one-out is not run unless asked for
RESTARTS = 8


@dataclass(frozen=True)
class Fit:
    """One fit to some units: the problem that was solved, its solution, what was seen, and the noise."""

    problem: Problem
    solution: Solution
    identifiability: Identifiability
    groups: tuple[Group, ...]
    data: DataSet  # with the sigma that was used
    restarted: int = 0


def frame_names(model: Chain, problem: Problem) -> tuple[str, ...]:
    """The free parameters of the baseline: instruments' frames, targets, other kinds' parameters, and the tool."""
    tool = {f"tool.{s}" for s in FRAME_SYMBOLS}
    return tuple(n for n in problem.table.free if n not in model.table or n in tool)


def baseline(model: Chain, data: DataSet, units: Ints, watch: Watch | None = None) -> tuple[Problem, Array]:
    """The nominal model with frames and tool fitted to some units: the problem over all data (weights on those units)
    and x (1, P)."""
    made = build(model, data).with_weights(_weights(len(data.configurations), units))
    if watch:
        watch({"stage": "start"})
    candidates: list[dict[str, float]] = [{}]
    for obs in data.observations:
        found = starts.closed_form(model, data, obs, units)
        candidates = [{**a, **b} for a in candidates for b in (found or [{}])][:32]
    frames = frame_names(model, made)
    seen = analyse(made.with_free(frames), made.start) if frames else None
    return made, starts.refine(made, seen.kept if seen else (), [c for c in candidates if c])


def _weights(count: int, units: Ints) -> Array:
    w = np.zeros((1, count))
    w[:, units] = 1.0
    return w


def fit(model: Chain, stated: DataSet, units: Ints, options: Options, start: Array, watch: Watch | None = None) -> Fit:
    """Fits everything that is free and seen to some units, starting from x (1, P)."""
    weights = _weights(len(stated.configurations), units)
    made = build(model, stated).with_weights(weights).with_loss(options.loss, options.tuning)
    made = replace(made, priors=options.priors)
    names = made.table.free
    if not names:
        raise ModelError("nothing is free to be identified", key="calibrate.free", expected="at least one parameter")
    plain = options.method in ("pinv", "lse")
    tau: dict[tuple[str, str], float] = {}
    if not plain:
        # The first guess of the noise: what the baseline leaves.
        tau = {(g.name, g.unit): g.tau for g in assess(stated, made, start, units, 0) if g.stated is None}
    solution: Solution | None = None
    groups: list[Group] = []
    restarted = 0
    kept: tuple[str, ...] = ()
    for turn in range(1 if plain else ROUNDS):
        data = apply_noise(stated, tau)
        candidate = replace(
            build(model, data).with_weights(weights).with_loss(options.loss, options.tuning),
            free=names,
            priors=options.priors,
        )
        seen = analyse(candidate, start if solution is None else solution.x)
        kept = names if plain or options.keep_all else seen.kept
        chosen = candidate.with_free(kept)
        solution = least_squares(
            chosen, start, method=options.method, max_iterations=options.max_iterations, watch=watch
        )
        if not plain and _unacceptable(solution):
            solution, restarted = _restart(chosen, start, solution, options)
        groups = assess(stated, chosen, solution.x, units, len(kept))
        new = {(g.name, g.unit): g.tau for g in groups if g.tau > 0}
        if watch:
            watch({"stage": "round", "round": turn + 1, "rounds": ROUNDS, "kept": len(kept), "free": len(names)})
        settled = set(new) == set(tau) and all(abs(new[k] - tau[k]) < 0.02 * tau[k] for k in new)
        if turn + 1 == ROUNDS or settled:
            break
        tau = new
    assert solution is not None
    final = analyse(candidate, solution.x)
    if not plain and not options.keep_all:
        # The report speaks of the set that was fitted.
        final = replace(
            final, kept=kept, dropped=tuple(n for n in names if n not in kept), combinations=seen.combinations
        )
    return Fit(chosen, solution, final, tuple(groups), data, restarted)


def _unacceptable(solution: Solution) -> bool:
    return not solution.reasons[0].converged or not np.isfinite(solution.cost[0])


def _restart(problem: Problem, start: Array, first: Solution, options: Options) -> tuple[Solution, int]:
    """Deterministic multi-start around the baseline: one batch, the cheapest wins."""
    rng = np.random.default_rng(options.seed)
    x = np.repeat(start, RESTARTS, axis=0)
    moved = problem.retract(x, rng.normal(size=(RESTARTS, problem.n)) * problem.scales)
    many = least_squares(problem, moved, max_iterations=options.max_iterations)
    cost = np.where(np.isfinite(many.cost), many.cost, np.inf)
    best = int(np.argmin(cost))
    if not cost[best] < first.cost[0]:
        return first, RESTARTS
    again = least_squares(problem, many.x[[best]], max_iterations=options.max_iterations)
    return again, RESTARTS


def identify(model: Chain, data: DataSet, options: Options | None = None, watch: Watch | None = None) -> Identification:
    """Identifies a model from data; see the module for the steps. Raises ModelError when nothing is free or nothing
    was measured."""
    options = options or Options()
    count = len(data.configurations)
    if not data.observations or not count:
        raise ModelError("the data set holds no measurement")
    fraction = options.hold_out if options.hold_out is not None else (0.2 if count >= FEW else 0.0)
    fit_units, held = stratified(data.configurations, fraction, options.seed)
    everyone = np.arange(count)
    base_problem, base_x = baseline(model, data, fit_units, watch)
    part = fit(model, data, fit_units, options, base_x, watch)
    whole = part
    if len(held):
        _, all_x = baseline(model, data, everyone, watch)
        whole = fit(model, data, everyone, options, all_x, watch)
    wanted = options.leave_one_out if options.leave_one_out is not None else count <= MANY
    wanted = wanted and count > 2 and options.method in ("lm", "gauss-newton")
    loo = _leave_one_out(model, base_problem, base_x, whole, everyone, watch) if wanted else {}
    stages = tuple(
        s
        for u in ("m", "rad", "px")
        if (s := _stages(data, base_problem, base_x, part, fit_units, held, loo, u)) is not None
    )
    verdict = _verdict(data, base_problem, base_x, part, fit_units, held, loo, options)
    u = uncertainty(whole.problem, whole.solution.x, estimated=any(g.stated is None for g in whole.groups))
    values = whole.solution.x[0]
    names = whole.problem.table.names
    table = whole.problem.table.with_values(values[: len(names)])
    corrected = model.with_values({n: float(v) for n, v in zip(names, values, strict=False) if n in model.table})
    results = parameter_results(model, whole, u)
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
        data_warnings(model, data, whole, fit_units),
    )


def _leave_one_out(
    model: Chain, base: Problem, base_x: Array, whole: Fit, units: Ints, watch: Watch | None
) -> dict[str, tuple[Array, Array]]:
    """Errors (baseline, identified) with every configuration left out once, by unit."""
    if watch:
        watch({"stage": "leave-one-out", "units": len(units)})
    frames = tuple(n for n in frame_names(model, base) if n in whole.problem.free)
    noisy = replace(whole.problem, free=frames)
    out = {}
    for unit in ("m", "rad"):
        if any(u == unit for t in base.terms for _, _, u in t.parts):
            out[unit] = (
                leave_one_out(noisy, base_x, units, unit) if frames else errors(base.residuals(base_x), unit)[0],
                leave_one_out(whole.problem, whole.solution.x, units, unit),
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


def _constant(data: DataSet, fit_units: Ints, held: Ints) -> Array | None:
    """What predicting the mean would miss, where positions were measured by one instrument; None otherwise."""
    found = [o for o in data.observations if o.kind in ("position", "pose")]
    if (
        len(found) != 1
        or found[0].value.ndim != 2
        or (found[0].target is not None and len(np.unique(found[0].target)) > 1)
    ):
        return None
    return constant_errors(found[0].value[:, :3], found[0].configuration, fit_units, held)


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
    before, at = errors(base.residuals(base_x), "m")
    after, _ = errors(part.problem.residuals(part.solution.x), "m")
    kind = "held out"
    chosen = np.isin(at, held)
    if not len(held):
        if "m" not in loo:
            return Verdict("not_improved", ("nothing was held out, so nothing is proven",))
        before, after = loo["m"]
        chosen = np.ones(len(at), dtype=bool)
        kind = "leave-one-out"
    stated = [g.stated for g in part.groups if g.unit == "m" and g.stated is not None]
    return judge(
        before[chosen],
        after[chosen],
        _constant(data, fit_units, held),
        at[chosen],
        rank=part.identifiability.rank,
        converged=part.solution.reasons[0].converged,
        seed=options.seed,
        kind=kind,
        stated=float(np.sqrt(3) * stated[0]) if stated else None,
    )
