"""The estimators by name: each turns a problem and a start into a solution, and says what it can do.

    lm            Levenberg-Marquardt: the default
    gauss-newton  undamped
    ekf           the filter, one configuration after the other, then passes over all of them, each relinearised
    particle      the same, refined by particles under the loss's own density: for noise that is not Gaussian
    pinv          iterated pseudo-inverse of everything free: the seeds' iterated method
    lse           one step of it: the seeds' linear least-squares estimate
    ekf-100       all rows at once, P0 = Q = R = 1e-4 in cm and rad, 100 passes: the seeds' filter, its innovation put right

The last three are *blind*: they take everything that is free, seen or not, know no noise, and are here to be compared
with. Sources: see `estimate`; for the last two Attia and Ammari (2019), chapters 3 and 4.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.errors import ModelError, look_up
from robocal.estimate.least_squares import least_squares
from robocal.estimate.problem import Problem
from robocal.estimate.solution import Reason, Solution
from robocal.estimate.trail import Trail
from robocal.fit.options import Options
from robocal.progress import Watch
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["ESTIMATORS", "Estimate", "Estimator", "can_batch", "describe_end", "estimator"]

# How much wider than the expected error the filter starts where no prior is stated: it must not hold what the data know.
WIDE = 100.0
ROWS = 41  # configurations after which a filter's values are told: with their bands, and a picture shows no more
LOCAL_PASSES = 3  # iterations of the update with one configuration
# The seeds' P0 = Q = R = 1e-4 I: standard deviations of 0.01 cm and 0.01 rad.
SEED = {"m": 1e-4, "rad": 1e-2}


@record
class Estimate:
    """What an estimator found: a solution of the problem, its own covariance (n, n) where it has one that is not that of
    the linearised solution, and what is worth knowing; where it stood after its passes, and a filter after its configurations."""

    solution: Solution
    covariance: Array | None = None
    notes: tuple[Remark, ...] = ()
    passes: Trail | None = None
    filter: Trail | None = None


Run = Callable[[Problem, Array, Options, Watch | None], Estimate]


@record
class Estimator:
    """One way to solve a problem: `blind` takes all free columns and neither noise, priors, bounds nor losses; `minimises`
    the problem's cost, so that a batch of least-squares problems is its leave-one-out; `restarts` from
    other places when it fails; `finite` ends after a number of steps that was asked for, which counts as an end; `iterates` until
    a tolerance is met, where one was asked for."""

    name: str
    title: str
    run: Run
    blind: bool = False
    minimises: bool = False
    restarts: bool = False
    finite: bool = False
    iterates: bool = True


def _least_squares(method: str) -> Run:
    def run(problem: Problem, start: Array, options: Options, watch: Watch | None) -> Estimate:
        most, tolerance, passes = options.max_iterations, options.tolerance, Trail()
        found = least_squares(
            problem, start, method=method, max_iterations=most, tolerance=tolerance, watch=watch, trail=passes
        )
        return Estimate(found, passes=passes)

    return run


def _filter_problem(problem: Problem, start: Array) -> tuple[Problem, Array]:
    """The problem as the filter sees it: a prior on every column, stated or wide around the start; and where it starts."""
    names = np.array(problem.free)
    stated = problem.has_prior
    x = np.array(start)
    # What has a prior starts at its mean, wherever the baseline put it.
    x[:, problem.index[stated]] = problem.table.values[problem.index[stated]]
    wide = {str(n): WIDE * float(s) for n, s in zip(names[~stated], problem.scales[~stated], strict=True)}
    table = problem.table.with_values(x[0, : len(problem.table)]).with_priors(wide)
    return replace(problem.with_table(table), priors=True), x


def _filter(problem: Problem, start: Array, options: Options, watch: Watch | None) -> Estimate:
    """The sequential filter, then passes in which everything is relinearised at one point, until they settle.

    With one point of linearisation the order of the configurations no longer matters: such a pass is a Gauss-Newton step
    on all of them (Bell and Cathey, 1993), damped so that it always descends (Skoglund, Hendeby and Axehill, 2015), and
    is computed as one. `max_iterations` counts all passes; one is the EKF.
    """
    from robocal.estimate.kalman import kalman

    held, x = _filter_problem(problem, start)
    rows = Trail(ROWS)
    first = kalman(held, x, passes=LOCAL_PASSES, watch=watch, trail=rows)
    history = [problem.normal(start).cost, problem.normal(first.x).cost]
    passes = Trail(first=(start[0], first.x[0]))
    if options.max_iterations == 1:
        solved = _solution(problem, first.x, history, Reason.FILTERED)
        return Estimate(solved, first.covariance, passes=passes, filter=rows)
    left, tolerance = options.max_iterations - 1, options.tolerance
    settling = Trail(first=(start[0],))
    more = least_squares(held, first.x, max_iterations=left, tolerance=tolerance, watch=watch, trail=settling)
    here = held.normal(first.x).cost[0]
    if not (more.reasons[0].converged and more.cost[0] <= here * (1 + 1e-9)):
        note = Remark.of(Code.FILTER_UNSETTLED)
        solved = _solution(problem, first.x, history, Reason.ITERATIONS)
        return Estimate(solved, first.covariance, (note,), passes, rows)
    history += list(more.history[1:])
    return Estimate(_solution(problem, more.x, history, more.reasons[0]), passes=settling, filter=rows)


def _particles(problem: Problem, start: Array, options: Options, watch: Watch | None) -> Estimate:
    """The filter's answer, refined by particles under the problem's own loss."""
    from robocal.estimate.particle import particles

    before = _filter(problem, start, options, watch)
    held, _ = _filter_problem(problem, start)
    rng = np.random.default_rng(options.seed)
    cloud = particles(held, before.solution.x, rng, count=options.particles, watch=watch)
    gaussian = [Remark.of(Code.PARTICLES_GAUSSIAN)] if problem.loss == "none" else []
    stuck = [Remark.of(Code.PARTICLES_STUCK, share=cloud.accepted)] if cloud.accepted < 0.05 else []
    history = [*before.solution.history, problem.normal(cloud.mean).cost]
    found = _solution(problem, cloud.mean, history, Reason.FILTERED)
    if before.passes is not None:
        before.passes.add(len(history) - 1, cloud.mean[0], last=True)
    return Estimate(found, cloud.covariance, (*before.notes, *gaussian, *stuck), before.passes, before.filter)


def _seed(problem: Problem, start: Array, options: Options, watch: Watch | None) -> Estimate:
    """Chapter 4 of the seed: P0 = Q = R, all rows at once; the innovation is what is measured less what the model says."""
    from robocal.estimate.kalman import stack_filter

    p = np.diag([SEED.get(problem.table[n].unit, 1e-2) ** 2 for n in problem.free])
    counted = [(t, problem.in_use[t.configuration] & t.used) for t in problem.terms]
    noise = np.concatenate([_noise(t.scale, t.parts)[c].ravel() for t, c in counted])
    most, tolerance = options.max_iterations, options.tolerance
    passes = Trail()
    f = stack_filter(
        problem,
        start,
        covariance=p,
        process=p,
        noise=noise,
        passes=most,
        tolerance=tolerance,
        watch=watch,
        trail=passes,
    )
    ended = Reason.ITERATIONS if np.isfinite(f.x).all() else Reason.NOT_FINITE
    reason = Reason.TOLERANCE if f.within else ended
    return Estimate(_solution(problem, f.x, list(f.history[:, None]), reason), passes=passes)


def _noise(scale: Array, parts: tuple[tuple[int, int, str], ...]) -> Array:
    """The seeds' R over the variance that whitened each row, (m, d)."""
    out = np.array(scale)
    for start, stop, unit in parts:
        out[:, start:stop] *= SEED.get(unit, 1.0)
    return out**2


def _solution(problem: Problem, x: Array, history: list[Array], reason: Reason) -> Solution:
    normal = problem.normal(x)
    costs = np.array(history).reshape(-1, 1)
    count = np.array([len(costs) - 1], dtype=np.int64)
    return Solution(x, normal.cost, count, np.array([int(reason)]), costs, (normal,))


ESTIMATORS = {
    e.name: e
    for e in (
        Estimator("lm", "Levenberg-Marquardt", _least_squares("lm"), minimises=True, restarts=True),
        Estimator("gauss-newton", "Gauss-Newton", _least_squares("gauss-newton"), minimises=True, restarts=True),
        Estimator("ekf", "iterated extended Kalman filter", _filter, minimises=True),
        Estimator("particle", "particle filter after the Kalman filter", _particles, iterates=False),
        Estimator("pinv", "iterated pseudo-inverse", _least_squares("pinv"), blind=True),
        Estimator(
            "lse", "one linear least-squares step", _least_squares("lse"), blind=True, finite=True, iterates=False
        ),
        Estimator("ekf-100", "the seed's stacked Kalman filter", _seed, blind=True, finite=True),
    )
}


def estimator(name: str, loss: str = "none") -> Estimator:
    """The estimator of this name, if it knows that loss. Raises ModelError with the nearest name."""
    found = look_up(ESTIMATORS, name, "unknown method", "--method")
    if loss != "none" and found.blind:
        raise ModelError(f"{found.title} knows no robust loss", key="--loss", found=loss, expected="--method lm")
    return found


def can_batch(options: Options) -> bool:
    """Whether leave-one-out of this choice is one batch of least-squares problems: the estimator ends at their minimum."""
    found = estimator(options.method)
    # One pass of the filter is an estimate of its own, not the minimum that further passes settle at.
    # One that stops at a tolerance need not have come there either.
    stops = options.tolerance is not None or (found.run is _filter and options.max_iterations == 1)
    return found.minimises and not stops


def describe_end(method: str, reason: Reason) -> tuple[str, bool]:
    """How a method ended in words, and whether it stopped without converging."""
    if estimator(method).finite and reason != Reason.TOLERANCE:
        return "as many steps as were asked for", False
    return reason.text, not reason.converged
