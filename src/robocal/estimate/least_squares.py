"""Levenberg-Marquardt in lock step over a batch, and the plainer methods it is compared with.

    lm            (A + lam D) step = -g, D = largest diag(A) seen (More, 1978), at least 1e-4 |r|^2 / expected error^2;
    lam follows the gain ratio; bounds by holding columns
    gauss-newton  A step = -g
    pinv          step = -J^+ r with the pseudo-inverse cut at machine precision: the seeds' iterated method, one
    problem at a time
    lse           one step of pinv: the seeds' linear least-squares estimate

Every problem of a batch has its own damping and its own stop; B = 1 is the ordinary case and takes the same path. A
step that does not lower the cost is never taken by lm, but the first one that fails is followed by one more from where it
ended: in a narrow curved valley a straight step leaves the floor by its curvature, and the second one comes back to it
further on. Both are taken if together they lower the cost; without that, noise-free data make short steps for hundreds
of iterations. References: Madsen, Nielsen, Tingleff, Methods for non-linear least squares problems (2004); Chamberlain,
Powell, Lemarechal and Pedersen, The watchdog technique (1982).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.errors import ModelError, one_of
from robocal.estimate.damping.steps import Steps
from robocal.estimate.problem import Problem
from robocal.estimate.solution import Reason, Solution
from robocal.estimate.terms import Normal
from robocal.estimate.trail import Trail, keep
from robocal.progress import Watch, tell

__all__ = ["CROWD", "METHODS", "least_squares"]

METHODS = ("lm", "gauss-newton", "pinv", "lse")
EPS = float(np.finfo(float).eps)
NEAR = 0.02  # of the cost: what the last step lowered it by when curvature begins to count
ROUGH = 1e-3  # of the cost: where Huber's loss hands over to Tukey's
AT_ONCE = 1 << 19  # numbers of normal equations that are kept while a batch moves: more would leave the cache
SHARED = 8  # problems that begin at one x share what rows say there, which is worth more than the cache
# Where a descent ends, besides the decrease: the largest cosine between the residual and a column, a step over the expected error.
ORTHOGONAL, STILL = 1e-13, 1e-15
# Of several starts, one that costs so many times what another ended with, after so many iterations, leads elsewhere.
WORSE, PATIENCE = 10.0, 20
# One of a crowd that stands so near a better one, in expected errors, at as much of its cost more, leads to where that one does.
NEIGHBOUR, CROWD = 1e-3, 8
SURE = 1e-2  # how far below the tolerance the promise that follows a last step is
LONG = 1e-3  # of the expected error: a step that fails for rounding is shorter


# Plain integers: looking an enum up costs more than a small solve.
_RUNNING = int(Reason.RUNNING)
_MINIMUM = (int(Reason.COST), int(Reason.GRADIENT), int(Reason.STEP))


def least_squares(
    problem: Problem,
    x: Array | None = None,
    *,
    method: str = "lm",
    max_iterations: int = 100,
    cost_tolerance: float = 1e-10,
    damping: float = 1e-6,
    tolerance: float | None = None,
    watch: Watch | None = None,
    rivals: bool = False,
    trail: Trail | None = None,
    creep: float = 0.0,
    trust: bool = False,
) -> Solution:
    """Minimises the cost from x (B, P) or (P,), the table's values by default; `trail` hears where one problem stands on its way.

    `cost_tolerance` is relative: the decrease promised to the cost. `tolerance`, in m, stops where the greatest error is no larger,
    at the start too. `rivals` are starts of one problem, of which the best is wanted: none goes on far behind it, nor of a crowd beside
    a better one. `creep`, of the cost: once a step has failed, one that brings less is the last. `trust` takes a last step without looking
    where it leads, where it and the one before say that nothing follows: cost and normal equations are of before.
    """
    if x is None and problem.loss == "tukey":
        # What lies far off counts for nothing by Tukey's loss, and before the first iteration that may be everything.
        x = least_squares(
            problem.with_loss("huber"), method="lm", max_iterations=max_iterations, cost_tolerance=ROUGH, watch=watch
        ).x
    start = problem.start if x is None else np.array(np.atleast_2d(x), dtype=float, order="C")  # parts of it are moved
    if method in ("pinv", "lse"):
        return _pseudo_inverse(problem, start, 1 if method == "lse" else max_iterations, tolerance, watch, trail)
    if method not in METHODS:
        raise ModelError("unknown method", found=method, **one_of(method, METHODS))
    many, tolerances = _at_once(problem, start), _tolerances(cost_tolerance)
    parts: list[Solution] = []
    least, first = np.inf, damping if method == "lm" else 0.0  # what the best rival ended with
    for lo in range(0, max(len(start), 1), many):
        ended = _descend(
            problem, start[lo : lo + many], lo, max_iterations, tolerances, first, tolerance, watch, rivals, trail, creep, trust, least,
        )  # fmt: skip
        parts.append(ended)
        least = min(least, _least(ended.cost, ended.reason))
    return parts[0] if len(parts) == 1 else _join(parts)


def _least(cost: Array, reason: Ints) -> float:
    """The lowest cost (B,) at which a problem ended in a minimum."""
    return float(cost[np.isin(reason, _MINIMUM)].min(initial=np.inf))


@cache
def _tolerances(cost: float) -> Array:
    """Where a descent ends, as kernels read it."""
    return np.array([cost, ORTHOGONAL, STILL])


def _at_once(problem: Problem, start: Array) -> int:
    """How many problems of a batch move together from start (B, P)."""
    if len(start) == 1:
        return 1
    n, ((many, size), (more, wide)) = problem.n, problem.sizes
    each = n * n + many * size * (size + n) + more * wide * (wide + n) + len(problem.pairs) * size * wide
    few = AT_ONCE // max(each, 1)
    if few < SHARED and (start == start[0]).all():
        return SHARED
    return max(1, few)


def _join(parts: list[Solution]) -> Solution:
    """The solutions of parts of a batch as one; the history of one that ended early stays where it ended."""
    longest = max(len(s.history) for s in parts)
    history = [np.pad(s.history, ((0, longest - len(s.history)), (0, 0)), mode="edge") for s in parts]
    names = "x", "cost", "iterations", "reason"
    x, cost, iterations, reason = (np.concatenate([getattr(s, name) for s in parts]) for name in names)
    whole = np.concatenate(history, axis=1)
    return Solution(x, cost, iterations, reason, whole, tuple(p for s in parts for p in s.parts))


def _descend(
    problem: Problem,
    x: Array,
    base: int,
    most: int,
    tolerances: Array,
    damping: float,
    tolerance: float | None,
    watch: Watch | None,
    rivals: bool,
    trail: Trail | None,
    creep: float,
    trust: bool,
    other: float = np.inf,
) -> Solution:
    """From x (B, P), which are the problems base, base + 1, ... of the batch; `other` is what the best of their rivals
    ended with."""
    settle, (STAY, TAKE, OUT, HOME), LOST, GROW = _settling()
    batch = len(x)
    everyone = np.arange(base, base + batch)
    normal = problem.normal(x, everyone)
    reason, iterations = np.zeros(batch, dtype=np.int64), np.zeros(batch, dtype=np.int64)
    # failed: how long the last step was that did not lower the cost, in expected errors
    lam, grow, predicted, best, failed, before = [np.zeros(batch) for _ in range(6)]
    lam[:], grow[:] = damping, GROW
    first = normal.cost.copy()
    history = [first]
    keep(trail, 0, x[0])
    steps = Steps(problem, batch, tolerances, damping > 0.0)
    moved = (steps.step, *steps.local[: len(problem.families)])
    bounded, robust = problem.has_bounds, problem.loss != "none" and damping > 0
    value, away = np.empty((batch, 0)), np.zeros(batch, dtype=np.bool_)
    home: _Home | None = None
    bent = np.zeros(batch, dtype=np.bool_)  # near the end the curvature of a loss counts: weights alone would creep on
    fails = False  # whether any step ever did
    bumps = np.zeros(batch, dtype=np.bool_)  # whether one of each did
    while len(history) <= most:
        if tolerance is not None:
            _stop_within(problem, x, tolerance, away, reason)
        if rivals and batch > CROWD and len(history) > 1:
            _leave_to_better(problem, x, normal.cost, away, reason)
        if rivals and len(history) > PATIENCE:
            least = min(other, _least(normal.cost, reason))
            reason[(reason == _RUNNING) & (normal.cost > WORSE * least)] = int(Reason.ITERATIONS)
        if bounded:
            value = np.ascontiguousarray(x[:, problem.index])
        going = steps.propose(normal, value, away, lam, predicted, reason)
        if home is not None and (reason == LOST).any():
            lost = np.flatnonzero(reason == LOST)
            home.back(lost, x, normal)
            away[lost], reason[lost] = False, _RUNNING
            lam[lost], grow[lost] = np.maximum(lam[lost], 1e-9) * GROW, 2 * GROW
            continue
        if trust and not (fails or bounded or robust):  # promises fall at least as fast as before
            last = (reason == _RUNNING) & (predicted**2 <= SURE * tolerances[0] * normal.cost * before)
            before, going = np.array(predicted), going - int(last.sum())
            if last.any():
                x[last] = problem.retract(x[last], *(m[last] for m in moved))
                iterations[last], reason[last] = iterations[last] + 1, int(Reason.COST)
        if not going:
            break
        at = None if going == batch else (reason == _RUNNING).nonzero()[0]
        new = problem.retract(x, *moved) if at is None else problem.retract(x[at], *(m[at] for m in moved))
        if bounded:
            new[:, problem.index] = np.clip(new[:, problem.index], *problem.bounds)
        which, curved = (everyone, bent) if at is None else (everyone[at], bent[at])
        result = problem.normal(new, which, curved if robust else None)
        move = np.empty(going, dtype=np.int64)
        taken = settle(
            normal.cost, result.cost, first, predicted, damping > 0.0, lam, grow, best, away, iterations, reason, move
        )
        if robust:
            some = slice(None) if at is None else at
            bent[some] = (move == TAKE) & (normal.cost[some] - result.cost < NEAR * normal.cost[some])
        if taken == batch:
            x, normal = new, result
            if fails:
                failed[:] = 0.0
        else:
            fails = True
            at = np.arange(batch) if at is None else at
            failed[at[move == TAKE]] = 0.0
            first_fails = at[(move == STAY) | (move == OUT)]
            bumps[first_fails] = True
            failed[first_fails] = np.abs(steps.step[first_fails] / problem.scales).max(axis=1, initial=0.0)
            if (move == OUT).any():
                home = home or _Home(x, normal)
                home.keep(at[move == OUT], x, normal)
            if home is not None and (move == HOME).any():
                home.back(at[move == HOME], x, normal)
            go = np.flatnonzero((move == TAKE) | (move == OUT))
            x[at[go]] = new[go]
            normal.put(at[go], result if len(go) == going else result.take(go))
        history.append(normal.cost.copy() if home is None else np.where(away, best, normal.cost))
        if trail is not None:
            trail.add(len(history) - 1, home.x[0] if home is not None and away[0] else x[0])
        if creep and fails:
            gain = history[-2] - history[-1]
            reason[(reason == _RUNNING) & bumps & (gain > 0) & (gain < creep * history[-1])] = int(Reason.ITERATIONS)
        if watch:
            watch({"stage": "iterate", "iteration": len(history) - 1, "cost": float(history[-1][0]), "active": going})
    else:
        if tolerance is not None:
            _stop_within(problem, x, tolerance, away, reason)
        reason[reason == _RUNNING] = int(Reason.ITERATIONS)
    if fails:
        # A step that is nothing because the damping that a long one called for made it so is no minimum.
        reason[(reason == int(Reason.STEP)) & (failed > LONG)] = int(Reason.STALLED)
    if home is not None and away.any():
        home.back(np.flatnonzero(away), x, normal)
    ended = partial(problem.normal, np.array(x), everyone) if robust and bent.any() else normal
    return Solution(x, normal.cost, iterations, reason, np.array(history), (ended,))


def _leave_to_better(problem: Problem, x: Array, cost: Array, away: Bools, reason: Ints) -> None:
    """Stops the running problems that stand where a better one does; one on trial stands nowhere yet."""
    ruler = np.ones(x.shape[1])
    ruler[problem.index] = problem.scales
    kept: list[int] = []
    for b in np.argsort(cost, kind="stable").tolist():
        if away[b] or not np.isfinite(cost[b]):
            continue
        near = [k for k in kept if cost[b] - cost[k] <= NEIGHBOUR * cost[k]]
        if (np.abs(x[near] - x[b]) <= NEIGHBOUR * ruler).all(axis=1).any():
            reason[b] = int(Reason.ITERATIONS) if reason[b] == _RUNNING else reason[b]
        else:
            kept.append(b)


def _stop_within(problem: Problem, x: Array, tolerance: float, away: Bools, reason: Ints) -> None:
    """Stops the running problems whose greatest error is within the tolerance; one on trial stands nowhere yet."""
    running = np.flatnonzero((reason == _RUNNING) & ~away)
    if len(running):
        reason[running[problem.greatest_error(x[running]) <= tolerance]] = int(Reason.TOLERANCE)


@cache
def _settling() -> tuple[Callable[..., int], tuple[int, int, int, int], int, float]:
    """What says what becomes of steps, and its codes: an import costs as much as a small kernel."""
    from robocal.estimate.damping._kernels import GROW, HOME, LOST, OUT, STAY, TAKE, settle

    return settle, (STAY, TAKE, OUT, HOME), LOST, GROW


class _Home:
    """Where each problem of a batch stood before a step that it follows on trial."""

    def __init__(self, x: Array, normal: Normal) -> None:
        self.x, self.normal = np.array(x), normal.take(np.arange(len(x)))

    def keep(self, index: Ints, x: Array, normal: Normal) -> None:
        """Notes where some problems stand."""
        self.x[index] = x[index]
        self.normal.put(index, normal.take(index))

    def back(self, index: Ints, x: Array, normal: Normal) -> None:
        """Puts them back there."""
        x[index] = self.x[index]
        normal.put(index, self.normal.take(index))


def _pseudo_inverse(
    problem: Problem, x: Array, most: int, tolerance: float | None, watch: Watch | None, trail: Trail | None
) -> Solution:
    if len(x) != 1 or problem.blocks:
        message = "the pseudo-inverse method solves one problem without local blocks"
        raise ModelError(message, found=f"{len(x)} problems, {problem.blocks} blocks")
    history = []
    best, best_x = np.inf, x
    reason = Reason.ITERATIONS
    count = 0
    for count in range(most + 1):
        lin = problem.linearize(x)
        cost = 0.5 * float(lin.r @ lin.r)
        history.append([cost])
        keep(trail, count, x[0])
        tell(watch, "iterate", iteration=count, cost=cost, active=1)
        if not np.isfinite(cost):
            reason = Reason.NOT_FINITE
            break
        if tolerance is not None and most > 1 and problem.greatest_error(x)[0] <= tolerance:
            best_x, reason = x, Reason.TOLERANCE
            break
        if cost < best:
            best, best_x = cost, x
        elif most > 1 and count > 3:
            # At machine precision the cost only jitters, and the best point seen is the answer; otherwise it diverges.
            jitter = cost - best <= 1e-8 * best + 1e-16 * history[0][0]
            reason = Reason.COST if jitter else Reason.STALLED
            break
        if count == most:
            break
        step = -np.linalg.pinv(lin.j, rcond=EPS * max(lin.j.shape)) @ lin.r
        x = problem.retract(x, step[None])
    if most == 1:
        best_x = x
    normal = problem.normal(best_x)
    return Solution(best_x, normal.cost, np.array([count]), np.array([int(reason)]), np.array(history), (normal,))
