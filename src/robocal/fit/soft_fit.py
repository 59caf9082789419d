"""How large the noise is: what a fit of everything that is free leaves, each column held softly at HOLD times its expected error."""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Ints
from robocal.estimate.choosing.choice import choose
from robocal.estimate.least_squares import least_squares
from robocal.estimate.problem import Problem
from robocal.estimate.uncertainty import effective_columns
from robocal.fit.noise import Tau, assess, same_tau, tau_of, under
from robocal.measure.data import DataSet, same_rows
from robocal.measure.machine import Model, freedom_of

__all__ = ["CLEARLY", "CREEPING", "NEAR", "find_large_errors", "find_noise", "recall_rounds", "soften", "tries_noise"]

SOFT_ROUNDS = 8
# How much wider than the expected error the soft hold is: it must keep unseen directions from running away, and must not pass
# errors that are merely larger than expected for noise.
HOLD = 10.0
CLEARLY, HOPE = 0.5, 0.75  # of tau: far less, and what may still become it
# Where a fit ends whose noise alone is asked. Along a curved valley it would creep on for a hundred steps, and they bring less
# than the hundredth to which that is known.
STEPS, CREEPING = 100, 20  # steps: elsewhere it has come to its end long before
NEAR = 1e-4  # of the cost, promised by the next step: rows that are far are far by then
EXACT = 1e-10  # where one ends whose numbers are told
ROUGH = 1e-3  # where a fit may be given up: a hundred such steps do not bring CLEARLY what is not near HOPE
FEW_ROWS = 2000  # of so many rows a fit under the stated noise is tried first


def soften(problem: Problem, start: Array) -> Problem:
    """The problem with every free column held at x (1, P), HOLD times as softly as its expected error."""
    return problem.soften(start, HOLD)


Rounds = list[tuple[Tau, Array]]


def tries_noise(model: Model, stated: DataSet) -> bool:
    """Whether the stated noise may be all there is: of few rows, none of which was set aside, and not of poses of their own."""
    rows = stated.observations
    stands = all(o.sigma is not None and o.used is None for o in rows)
    return stands and not freedom_of(model) and sum(map(len, rows)) <= FEW_ROWS


def recall_rounds(model: Model, stated: DataSet, configurations: Ints, start: Array) -> Rounds:
    """The rounds of `find_noise` that are known of some configurations from x (1, P): the search for gross rows and the fit after it ask
    the same."""
    memo, key = stated.configurations.memo, ("noise", configurations.tobytes(), start.tobytes())
    known = memo.get(key)
    if known is None or known[0] is not model or not same_rows(known[1], stated.observations, ("rounding",)):
        known = memo[key] = model, stated.observations, []
    rounds: Rounds = known[2]
    return rounds


def find_noise(
    made: Problem,
    stated: DataSet,
    configurations: Ints,
    start: Array,
    begin: Array,
    rounds: Rounds | None = None,
    *,
    little: bool = False,
    creep: float = 0.0,
) -> tuple[Tau, Array]:
    """tau of every group when everything free may explain the data of a problem, softly held at the start and fitted from `begin`, (1, P)
    each; and where that fit ended. `rounds` are those that are known, from that of the beginning; `little`: it ends where a fit
    leaves more than the stated noise; `creep` as `least_squares` has it."""
    known = [] if rounds is None else rounds
    if little and not known:
        # Where the stated noise is all there is, a fit under it says so at once. Where it is not, nothing is known yet.
        tau, x = _fit_once(made, stated, configurations, start, {}, begin, creep)
        if not tau:
            known += [({}, begin), (tau, x)]
    if not known:
        # What is begun with has used up a degree of freedom for every number that it moved.
        moved = int((begin[0, made.index] != made.start[0, made.index]).sum())
        known.append((tau_of(assess(stated, made, begin, configurations, moved)), begin))
    while len(known) <= SOFT_ROUNDS:
        tau, x = known[-1]
        if len(known) > 1 and (same_tau(tau, known[-2][0], 0.01) or (little and tau)):
            break
        known.append(_fit_once(made, stated, configurations, start, tau, x, creep))
    return known[-1]


def _fit_once(
    made: Problem, stated: DataSet, configurations: Ints, start: Array, tau: Tau, begin: Array, creep: float
) -> tuple[Tau, Array]:
    """tau of every group that a soft fit from `begin` leaves under a noise enlarged by tau, and where that fit ended; see `find_noise`."""
    noisy = under(made, stated, tau)
    soft = soften(noisy, start)
    # Where rows are weighed anew at every step, the way is longer without being a valley.
    most = CREEPING if soft.loss == "none" else STEPS
    ended = least_squares(soft, begin, max_iterations=most, creep=creep)
    # A column counts as far as the data, not the hold, decide it.
    columns = effective_columns(soft, ended.x, ended)
    return tau_of(assess(stated, noisy, ended.x, configurations, columns)), ended.x


def find_large_errors(
    made: Problem, stated: DataSet, configurations: Ints, start: Array, tau: Tau, soft: Array
) -> tuple[Tau, Array]:
    """The noise once more without any hold, if that leaves far less: one length typed wrong by a decimal is no noise.

    Free is what would be seen under the stated noise alone (a tenth of a millimetre where none is stated).
    """
    if not tau:
        return tau, soft
    kept = choose(made, start).basis
    chosen = made.with_free(kept)
    if not kept or made.numbers[configurations].sum() < 2 * len(kept):
        return tau, soft
    # Without a hold the way may lead along a valley in short steps: it is gone to its end where its beginning leaves less.
    for tolerance, share in ((ROUGH, HOPE), (EXACT, CLEARLY)):
        solution = least_squares(chosen, start, cost_tolerance=tolerance)
        if not np.isfinite(solution.cost[0]):
            return tau, soft
        new = tau_of(assess(stated, chosen, solution.x, configurations, len(kept)))
        if not all(new.get(k, 0.0) < share * t for k, t in tau.items()):
            return tau, soft
    return new, solution.x
