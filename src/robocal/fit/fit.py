"""One fit: how large the noise is, what can be seen above it, and the parameters.

    1 noise    everything that is free, each column held softly at ten times its expected error; noise is what remains
    2 select   the columns that are seen above that noise; the others stay where they are
    3 fit      those columns alone, without the soft hold, by the chosen estimator, first with the noise of step 1, then
    with their own

The noise must come from a fit that explains all it can. Taken from a fit of a few columns it would contain their
missing partners, hide them, and so confirm itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from robocal._record import field, record, replace
from robocal._types import Array, Ints
from robocal.errors import ModelError
from robocal.estimate.choosing.choice import STRUCTURAL, Choice, choose
from robocal.estimate.elimination import Squares, reducible, spare_numbers, squares
from robocal.estimate.identifiability import Identifiability, analyse
from robocal.estimate.least_squares import least_squares
from robocal.estimate.problem import Problem
from robocal.estimate.solution import Solution
from robocal.estimate.uncertainty import Total, Uncertainty, effective_columns, total, uncertainty, uneven
from robocal.fit.estimators import Estimate, estimator
from robocal.fit.limits import FRAME_NEVER_TURNED, FRAME_TURNED
from robocal.fit.noise import NoiseGroup, Tau, apply_noise, assess, noise_dof, same_tau, tau_of, under
from robocal.fit.options import Options
from robocal.fit.place_noise import visit_again, weigh_visits
from robocal.fit.repeats import places
from robocal.fit.scale import InstrumentScales, add_scales, scales_of
from robocal.fit.soft_fit import (
    CLEARLY,
    CREEPING,
    NEAR,
    find_large_errors,
    find_noise,
    recall_rounds,
    soften,
    tries_noise,
)
from robocal.fit.subsample import subsample
from robocal.geometry import so3
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet
from robocal.measure.machine import Model, freedom_of
from robocal.parameters import FRAME_SYMBOLS
from robocal.progress import Watch, tell
from robocal.remarks.remark import Remark

__all__ = ["Fit", "chosen_weights", "fit", "frame_names", "near", "search_poses_again"]

RESTARTS = 8
THERE = 1e-6  # tolerance: of the cost: two starts that differ by less have ended at one place
NO_NOISE = 5.0  # sigma: what leaves more may have begun in the wrong place
ELSEWHERE, SCATTER = 4, 0.5  # sets of poses that are tried then, and how far they scatter, of where each began alone


@record
class Fit:
    """One fit to some configurations: the problem that was solved, its solution, what was seen, and the noise."""

    problem: Problem
    solution: Solution
    identifiability: Identifiability
    groups: tuple[NoiseGroup, ...]
    data: DataSet  # with the sigma that was used
    restarted: int = 0
    covariance: Array | None = None  # of the free columns, where the estimator has one of its own
    notes: tuple[Remark, ...] = ()
    # Scales of instruments that were known, by what they may be off.
    scale_errors: Mapping[str, float] = field(default_factory=dict)
    estimate: Estimate | None = None  # with where it stood on its way

    @property
    def uncertainty(self) -> Uncertainty:
        """Of the fitted columns, linearised at the solution."""
        return self._uncertainties[0]

    @property
    def total(self) -> Total:
        """What the parameters may be off by, hidden partners included."""
        return self._uncertainties[1]

    @property
    def scales(self) -> InstrumentScales | None:
        """The scales of instruments that are not known; None where all are."""
        return self._uncertainties[2]

    @cached_property
    def spare(self) -> Ints:
        """How many numbers each configuration leaves beyond those that its own pose takes, (U,)."""
        return spare_numbers(self.problem, self.solution.x)

    @cached_property
    def _uncertainties(self) -> tuple[Uncertainty, Total, InstrumentScales | None]:
        problem, x = self.problem, self.solution.x
        every, lin = problem.with_free(self.identifiability.names), None
        if problem.loss == "none" and not problem.blocks and np.array_equal(self.identifiability.x, x):
            # Linearised there already.
            r = problem.with_free(()).linearize(x).r
            known = Squares(every.free, self.identifiability.root, float(r @ r), len(r))
        else:
            lin = every.linearize(x)
            known = squares(every, x, None if reducible(every) else lin)
        u = uncertainty(problem, x, estimated=any(g.stated is None for g in self.groups), known=known)
        dof = noise_dof(self.groups, u.dof)
        # Noise that was stated and stands is even; what a model leaves need not be.
        visits = places(self.data.configurations)
        own = None if lin is None else every.column_of[problem.index]
        more = np.sqrt(uneven(problem, x, visits, lin, known, own)) if np.isfinite(dof) else 1.0
        scales = scales_of(every, problem.free, x, self.data, known, lin, self.scale_errors)
        whole = total(every, problem.free, x, factor=u.factor * float(more), dof=dof, known=known)
        return u, add_scales(whole, scales), scales


def chosen_weights(count: int, configurations: Ints) -> Array:
    """One for the configurations that are fitted, zero for the others, (1, count)."""
    w = np.zeros((1, count))
    w[:, configurations] = 1.0
    return w


def fit(
    model: Model, stated: DataSet, configurations: Ints, options: Options, start: Array, watch: Watch | None = None
) -> Fit:
    """Fits everything that is free and seen to some configurations, starting from x (1, P)."""

    def begin_with(data: DataSet, chosen: Ints) -> Problem:
        made = build(model, data).with_weights(chosen_weights(len(data.configurations), chosen))
        made = made.with_loss(options.loss, options.tuning)
        return made if options.priors else made.with_priors(False)

    first, start = begin_with(stated, configurations), np.array(start)
    for t in first.table.turns:  # half a turn may come out of a closed form as either; a step never changes which
        start[:, t : t + 3] = so3.nearest(start[:, t : t + 3], first.table.values[t : t + 3])

    def problem_at(tau: Tau) -> Problem:
        return under(first, stated, tau)

    candidate, names = first, first.free
    if not names:
        own = bool(model.table.rows)
        expected = "at least one parameter" if own else "a frame of a data file whose place is to be found"
        key = "calibrate.free" if own else "frame.free"
        raise ModelError("nothing is free to be identified", key=key, expected=expected)
    method = estimator(options.method, options.loss)
    if method.blind:
        found = method.run(candidate, start, options, watch)
        solution = found.solution
        groups = assess(stated, candidate, solution.x, configurations, len(names))
        # A step taken blindly deserves a covariance in units of what it left behind.
        tau = tau_of(g for g in groups if g.stated is None)
        candidate = problem_at(tau)
        final = analyse(candidate, solution.x)
        return Fit(candidate, solution, final, tuple(groups), apply_noise(stated, tau), estimate=found)
    few, some = subsample(model, stated, configurations)
    near_by, rounds, creep = start, None, 0.0
    if options.loss == "none" and options.priors and tries_noise(model, stated):
        rounds = recall_rounds(model, stated, configurations, start)
    elif few is not stated:  # of many rows a part says about where the soft fit of all ends
        creep = NEAR if options.loss == "none" else 0.0
        _, near_by = find_noise(begin_with(few, some), few, some, start, start, creep=creep)
    tau, soft = find_noise(first, stated, configurations, start, near_by, rounds, creep=creep)
    tau, soft = find_large_errors(first, stated, configurations, start, tau, soft)
    tell(watch, "noise", groups=len(tau))
    candidate = problem_at(tau)
    if visit_again(stated, configurations):
        columns = effective_columns(soften(candidate, start), soft)
        weights = chosen_weights(len(stated.configurations), configurations)
        first = first.with_weights(weights * weigh_visits(stated, candidate, soft, configurations, columns))
        tau = tau_of(assess(stated, problem_at(tau), soft, configurations, columns))
        candidate = problem_at(tau)
    seen, begin = choose_columns(model, candidate, start, soft, FRAME_NEVER_TURNED)
    kept = names if options.keep_all else seen.basis
    restarted = 0
    for _ in range(2):
        chosen = candidate.with_free(kept)
        found = method.run(chosen, near(chosen, begin), options, watch)
        if not (found.solution.reasons[0].converged or options.keep_all):
            other, elsewhere = choose_columns(model, candidate, start, soft, FRAME_TURNED)
            if other.basis != kept:
                seen, kept, begin = other, other.basis, elsewhere
                chosen = candidate.with_free(kept)
                found = method.run(chosen, near(chosen, begin), options, watch)
        if method.restarts and not found.solution.reasons[0].converged:
            found, restarted = _restart(chosen, start, found, options), RESTARTS
        solution = found.solution
        groups = assess(stated, chosen, solution.x, configurations, effective_columns(chosen, solution.x))
        new = tau_of(groups)
        if same_tau(new, tau, 1e-3):
            break
        tau = new
        candidate = problem_at(tau)
    chosen = candidate.with_free(kept)
    final = analyse(candidate, solution.x)
    if not options.keep_all:
        # The report speaks of the set that was fitted.
        final = replace(final, fitted=seen)
    return Fit(
        chosen, solution, final, tuple(groups), apply_noise(stated, tau), restarted, found.covariance, found.notes, estimate=found
    )  # fmt: skip


def frame_names(model: Model, problem: Problem) -> tuple[str, ...]:
    """The free parameters of the baseline: instruments' frames, targets, other kinds' parameters, and the tool."""
    if freedom_of(model) == ():  # a pose that is known has nothing of its own: its clock is the instrument's
        return problem.table.free
    tool = {f"tool.{s}" for s in FRAME_SYMBOLS}
    return tuple(n for n in problem.table.free if n not in model.table or n in tool)


def choose_columns(model: Model, problem: Problem, start: Array, soft: Array, least: float) -> tuple[Choice, Array]:
    """The columns that are seen at `soft` (1, P), the robot softly fitted, and where a fit of them begins, (1, P). Where frames are told
    there by turns of which the robot makes less than the share `least` at `start` (1, P), nothing holds them: they stay where making
    leaves them, at the nominal values, and what else is seen is asked there.

    The little that a fitted robot turns where the nominal one does not is no lever to place a target with.
    """
    seen = choose(problem, soft)
    frames, basis = frame_names(model, problem), set(seen.basis)
    kept = tuple(n for n in frames if n in basis and not problem.table[n].prior_informs)
    made, known = problem.with_free(kept), [problem.free.index(n) for n in kept]
    before, after = squares(made.with_loss("none"), start).root * made.scales, seen.scaled[:, known]
    held = list(range(len(kept)))
    if not held or not (_alone(before) < least * _alone(after)).any():
        return seen, start
    while held and (short := _alone(before[:, held]) < FRAME_TURNED * _alone(after[:, held])).any():
        # Of several that say the same, the one of which least is expected is held.
        held.pop(min(np.flatnonzero(short), key=lambda k: float(np.linalg.norm(after[:, held[k]]))))
    if len(held) == len(kept):
        return seen, start
    loose = tuple(n for i, n in enumerate(kept) if i not in held)
    away = set(frames) - (set(kept) - set(loose))
    begin, table = np.array(start), problem.table
    for i in (table.index[n] for n in loose if not table[n].turn):
        begin[0, i] = table[table.names[i]].value
    found = choose(problem.with_free(tuple(n for n in problem.free if n not in away)), begin).basis
    at = tuple(problem.free.index(n) for n in found)
    return replace(seen, at=at, left=tuple(i for i in range(problem.n) if i not in at), loose=loose), begin


def _alone(columns: Array) -> Array:
    """What each column (m, k) says that the others do not, (k,): one over the standard deviation that it would have beside them."""
    values, vt = np.linalg.svd(columns, full_matrices=False)[1:]
    least = np.maximum(values, STRUCTURAL * values.max(initial=1.0))
    return np.asarray(1 / np.sqrt(((vt / least[:, None]) ** 2).sum(axis=0)))


def near(problem: Problem, start: Array) -> Array:
    """Where to start from x (B, P): a loss that forgets large residuals would forget all of them at a start that is
    millimetres away."""
    return least_squares(problem.with_loss("huber"), start).x if problem.loss == "tukey" else start


def search_poses_again(problem: Problem, x: Array) -> Array:
    """x (1, P), or x with other poses of the configurations, where a soft fit of everything free ends far cheaper from there: held at a
    nominal robot that is decimetres off, a pose may be cheaper upside down, or beyond the frame, and would stay so.

    Poses where they started alone are always tried. Where what is left is no noise, so are all upright in the middle, and scattered
    about it.
    """
    if not problem.families or problem.families[0].count != problem.configurations:
        return x
    place = problem.places[0]
    other = np.array(x)
    other[:, place] = problem.start[:, place]
    x, cost = _cheaper(problem, np.concatenate([x, other]))
    if 2 * cost <= NO_NOISE**2 * float(problem.numbers.sum()):
        return x
    poses = other[0, place].reshape(problem.configurations, -1)
    middle, spread = np.median(poses, axis=0), SCATTER * poses.std(axis=0)
    middle[3:] = spread[3:] = 0.0
    draw = np.random.default_rng(0).normal(size=(ELSEWHERE, *poses.shape))
    draw[0] = 0.0
    many = np.repeat(x, 1 + ELSEWHERE, axis=0)
    many[1:, place] = (middle + spread * draw).reshape(ELSEWHERE, -1)
    return _cheaper(problem, many)[0]


def _cheaper(problem: Problem, many: Array) -> tuple[Array, float]:
    """The first of many x (B, P), or another (1, P) from which a soft fit ends far cheaper, and the cost where it ends."""
    ended = least_squares(soften(problem, many[:1]), many, max_iterations=CREEPING)
    cost = np.where(np.isfinite(ended.cost), ended.cost, np.inf)
    best = int(np.argmin(cost))
    best = best if cost[best] < CLEARLY * cost[0] else 0
    return many[[best]], float(cost[best])


def _restart(problem: Problem, start: Array, first: Estimate, options: Options) -> Estimate:
    """Deterministic multi-start around the baseline: one batch, the cheapest wins, and where the first one was about to end one that has
    ended there."""
    rng = np.random.default_rng(options.seed)
    x = np.repeat(start, RESTARTS, axis=0)
    moved = problem.retract(x, rng.normal(size=(RESTARTS, problem.n)) * problem.scales)
    many = least_squares(problem, moved, max_iterations=options.max_iterations)
    cost = np.where(np.isfinite(many.cost), many.cost, np.inf)
    best = int(np.argmin(cost))
    if not cost[best] < (1 + THERE) * first.solution.cost[0]:
        return first
    return estimator("lm").run(problem, many.x[[best]], replace(options, tolerance=None), None)
