"""The baseline: the nominal model with instrument frames, targets and tool fitted, and nothing else of the robot.

It is fitted by the loss of the identified model and to the same rows. What a robust loss calls large is told by the noise in use,
and the nominal model leaves more than the identified one: each is measured by its own robust scale.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robocal._record import record
from robocal._types import Array, Ints
from robocal.estimate.choosing.choice import choose
from robocal.estimate.least_squares import least_squares
from robocal.estimate.problem import Problem
from robocal.fit.fit import chosen_weights, frame_names
from robocal.fit.limits import BASELINE_LESS, START_LOST
from robocal.fit.noise import Tau, apply_noise, assess, same_tau, tau_of
from robocal.fit.starts import search as starts
from robocal.fit.subsample import MANY, subsample
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet, same_rows
from robocal.measure.machine import Model
from robocal.progress import Watch, tell

__all__ = ["Baseline", "baseline", "check_baseline", "fit_baseline", "frame_names", "renew_baseline"]

ROUNDS = 8


@record
class Baseline:
    """The problem over all data (weights on the units that were fitted, loss and noise as they were used), where the fit
    ended, x (1, P), and whether it converged."""

    problem: Problem
    x: Array
    converged: bool = True


def fit_baseline(
    model: Model,
    data: DataSet,
    configurations: Ints,
    loss: str = "none",
    tuning: float | None = None,
    watch: Watch | None = None,
    near: Array | None = None,
    whole: DataSet | None = None,
    hopeless: Callable[[Problem, Array], bool] | None = None,
) -> Baseline:
    """The nominal model with frames and tool fitted to some configurations, by a loss, from `near` (1, P), else from all starts; of many
    rows from where a part of them says that frames stand, of a part of the `whole` from where that does. `hopeless` is asked where a fit
    found no end: whether no further round is wanted."""
    made = build(model, data).with_weights(chosen_weights(len(data.configurations), configurations))
    tell(watch, "start")
    x, seen, converged = _recall_or_fit(model, data, configurations, made, near, whole or data)
    if loss == "none":
        return Baseline(made, x, converged)
    first = made
    tau: Tau = {}
    for _ in range(ROUNDS):
        new = tau_of(assess(data, first.with_loss("huber"), x, configurations, float(len(seen))))
        if tau and same_tau(new, tau, 0.01):
            break
        tau = new
        made = build(model, apply_noise(data, tau)).with_weights(first.weights)
        if seen:
            # A loss that forgets large residuals would forget all of them at a start that is far away.
            near = least_squares(made.with_loss("huber").with_free(seen), x).x
            solution = least_squares(made.with_loss(loss, tuning).with_free(seen), near)
            x, converged = solution.x, solution.settled()
            if hopeless and not solution.reasons[0].converged and hopeless(made, x):
                break
    return Baseline(made.with_loss(loss, tuning), x, converged)


Placed = tuple[Array, tuple[str, ...], bool]


def _recall_or_fit(
    model: Model, data: DataSet, configurations: Ints, made: Problem, near: Array | None, whole: DataSet
) -> Placed:
    """As `_fit_frames`. Where the search for gross rows marked none, what it began with is what is asked again: what rounding leaves in
    rows moves no fit."""
    if near is not None:
        return _fit_from(model, made, near)
    memo, key = data.configurations.memo, ("baseline", configurations.tobytes())
    known = memo.get(key)
    if known is None or known[0] is not model or not same_rows(known[1], data.observations, ("rounding",)):
        found = _fit_part(model, data, configurations, made, whole) or _fit_frames(model, data, configurations, made)
        known = memo[key] = model, data.observations, found
    x, seen, converged = known[2]
    return np.array(x), seen, converged


def _fit_part(model: Model, data: DataSet, configurations: Ints, made: Problem, whole: DataSet) -> Placed | None:
    """As `_fit_frames`, of a part of many rows of all of which it is known where frames stand: from there, where the part sees the same
    of them. What it does not see must not stay where other rows have put it. None where that is not known, or is what is asked; a
    part of few rows looks for itself: two searches check each other."""
    if sum(map(len, whole.observations)) <= MANY:
        return None
    everyone = np.arange(len(whole.configurations))
    known = whole.configurations.memo.get(("baseline", everyone.tobytes()))
    part = data.configurations is not whole.configurations or len(configurations) < len(everyone)
    if not part or made.blocks or known is None or known[0] is not model:
        return None
    if not same_rows(known[1], whole.observations, ("rounding", "sigma", "used")):
        return None
    x, seen, _ = known[2]
    found = _fit_from(model, made, np.array(x))
    return found if found[1] == seen else None


def _fit_from(model: Model, made: Problem, near: Array) -> Placed:
    """As `_fit_frames`, from where they were found to stand, near (1, P)."""
    frames = frame_names(model, made)
    seen = choose(made.with_free(frames), near).basis if frames else ()
    if not seen and not made.blocks:
        return near, seen, True
    ended = least_squares(made.with_free(seen), near)
    return ended.x, seen, ended.settled()


def _fit_frames(model: Model, data: DataSet, configurations: Ints, made: Problem) -> Placed:
    """Frames and tool by plain least squares: x (1, P), the names that were seen, and whether the fit converged."""
    frames = frame_names(model, made)
    few, own = subsample(model, data, configurations)
    some = made if few is data else build(model, few).with_weights(chosen_weights(len(few.configurations), own))
    candidates = starts.combine_starts(model, few, own, some.with_free(frames))
    # What can be seen of the frames is asked where they are believed to stand, not at the table's zeros.
    there = made.with_table(made.table.with_values({n: v for n, v in candidates[0].items() if n in frames}))
    bare = made.with_free(())
    if bare.normal(made.start).cost[0] < START_LOST * bare.normal(there.start).cost[0]:
        there = made
    seen = choose(there.with_free(frames), there.start).basis if frames else ()
    if few is data or not seen:
        x, converged = starts.refine(made, seen, [c for c in candidates if c])
    else:
        ended = least_squares(made.with_free(seen), starts.refine(some, seen, [c for c in candidates if c])[0])
        x, converged = ended.x, ended.settled()
    return x, seen, converged


def renew_baseline(
    model: Model,
    before: tuple[DataSet, Baseline],
    data: DataSet,
    configurations: Ints,
    loss: str = "none",
    tuning: float | None = None,
) -> Baseline:
    """The baseline once more, of `data` with another sigma than those of `before`: where it is no other, nothing is done
    again."""
    stated, found = before
    pairs = [(a.sigma, b.sigma) for a, b in zip(stated.observations, data.observations, strict=True)]
    if all(a is b or (a is not None and b is not None and np.array_equal(a, b)) for a, b in pairs):
        return found
    return fit_baseline(model, data, configurations, loss, tuning, near=found.x)


def check_baseline(model: Model, found: Baseline, other: Array) -> Baseline:
    """The baseline; or, where another one's end x (1, P) leaves clearly less of the same rows, what a fit from there finds.

    A fit ends in the lowest valley only of those that its starts lie in: of two that began apart, one may have found a lower one.
    """
    cost = found.problem.with_free(()).normal(np.concatenate([found.x, other])).cost
    if not cost[1] < BASELINE_LESS * cost[0]:
        return found
    frames = found.problem.with_free(frame_names(model, found.problem))
    ended = least_squares(frames.with_free(choose(frames, other).basis), other)
    return Baseline(found.problem, ended.x, ended.settled()) if ended.cost[0] < cost[0] else found


def baseline(
    model: Model, data: DataSet, configurations: Ints, watch: Watch | None = None, whole: DataSet | None = None
) -> tuple[Problem, Array]:
    """The same by plain least squares: the problem over all data, and x (1, P)."""
    found = fit_baseline(model, data, configurations, watch=watch, whole=whole)
    return found.problem, found.x
