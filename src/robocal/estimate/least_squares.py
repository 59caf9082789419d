"""Levenberg-Marquardt in lock step over a batch, and the plainer methods it is compared with.

    lm            (A + lam D) step = -g, D = largest diag(A) seen (More, 1978); lam follows the gain ratio; bounds by holding columns
    gauss-newton  A step = -g
    pinv          step = -J^+ r with the pseudo-inverse cut at machine precision: the seeds' iterated method, one problem at a time
    lse           one step of pinv: the seeds' linear least-squares estimate

Every problem of a batch has its own damping and its own stop; B = 1 is the ordinary case and takes the same path. A step that does not
lower the cost is never taken by lm. Reference: Madsen, Nielsen, Tingleff, Methods for non-linear least squares problems (2004).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from robocal.errors import ModelError, nearest
from robocal.estimate.problem import Normal, Problem

__all__ = ["METHODS", "Reason", "Solution", "least_squares"]

Array = NDArray[np.float64]
Watch = Callable[[dict[str, object]], None]
METHODS = ("lm", "gauss-newton", "pinv", "lse")
EPS = float(np.finfo(float).eps)


class Reason(IntEnum):
    """Why an iteration stopped."""

    RUNNING = 0
    COST = 1  # the model promises no decrease that could be told from rounding
    GRADIENT = 2  # the residual is orthogonal to every column
    STEP = 3  # the step is below the resolution of x
    ITERATIONS = 4  # the allowed number of iterations is used up
    SINGULAR = 5  # no damping makes the matrix positive definite
    NOT_FINITE = 6  # the cost at the start is not a number
    STALLED = 7  # no step lowers the cost

    @property
    def converged(self) -> bool:
        """Whether the result is a minimum."""
        return self in (Reason.COST, Reason.GRADIENT, Reason.STEP)

    @property
    def text(self) -> str:
        """In words, for people."""
        return _WORDS[self]


_WORDS = {
    Reason.RUNNING: "still running",
    Reason.COST: "converged: no further decrease",
    Reason.GRADIENT: "converged: gradient is zero",
    Reason.STEP: "converged: step is zero",
    Reason.ITERATIONS: "stopped: too many iterations",
    Reason.SINGULAR: "stopped: singular",
    Reason.NOT_FINITE: "stopped: the residuals are not finite",
    Reason.STALLED: "stopped: no step lowers the cost",
}


@dataclass(frozen=True)
class Solution:
    """Where a solver ended: x (B, P), cost (B,), iterations (B,), reason (B,), history of costs (iterations + 1, B) and the normal equations."""

    x: Array
    cost: Array
    iterations: NDArray[np.int64]
    reason: NDArray[np.int64]
    history: Array
    normal: Normal

    @property
    def reasons(self) -> tuple[Reason, ...]:
        """The reasons as an enum."""
        return tuple(Reason(int(r)) for r in self.reason)


def least_squares(
    problem: Problem,
    x: Array | None = None,
    *,
    method: str = "lm",
    max_iterations: int = 100,
    cost_tolerance: float = 1e-10,
    gradient_tolerance: float = 1e-13,
    step_tolerance: float = 1e-15,
    damping: float = 1e-6,
    watch: Watch | None = None,
) -> Solution:
    """Minimises the cost from x (B, P) or (P,), the table's values by default.

    Tolerances are relative: decrease promised to cost, largest cosine between the residual and a column, step to expected error.
    """
    start = problem.start if x is None else np.atleast_2d(np.asarray(x, float))
    if method in ("pinv", "lse"):
        return _pseudo_inverse(problem, start, 1 if method == "lse" else max_iterations, watch)
    if method not in METHODS:
        raise ModelError("unknown method", found=method, expected=", ".join(METHODS), suggestion=nearest(method, METHODS))
    return _damped(
        problem,
        np.array(start),
        max_iterations,
        (cost_tolerance, gradient_tolerance, step_tolerance),
        damping if method == "lm" else 0.0,
        watch,
    )


def _damped(
    problem: Problem, x: Array, most: int, tolerances: tuple[float, float, float], damping: float, watch: Watch | None
) -> Solution:
    from robocal.estimate._kernels import damped_step

    cost_tolerance, gradient_tolerance, step_tolerance = tolerances
    batch, n = len(x), problem.n
    blocks, size = problem.blocks, problem.block_size
    diagonal = np.arange(n)
    normal = problem.normal(x)
    lam = np.full(batch, damping)
    grow = np.full(batch, 10.0)
    reason = np.where(np.isfinite(normal.cost), Reason.RUNNING, Reason.NOT_FINITE).astype(np.int64)
    iterations = np.zeros(batch, dtype=np.int64)
    history = [normal.cost.copy()]
    damp = np.zeros((batch, n))
    damp_local = np.zeros((batch, blocks, size))
    lower, upper = problem.bounds
    bounded = bool(np.isfinite(lower).any() or np.isfinite(upper).any())
    for _ in range(most):
        active = np.flatnonzero(reason == Reason.RUNNING)
        if not len(active):
            break
        everyone = len(active) == batch
        now = normal if everyone else normal.take(active)
        here = x if everyone else x[active]
        diag = now.a[:, diagonal, diagonal]
        # A column that carries nothing still needs a positive pivot to stay where it is.
        floor = np.maximum(diag.max(axis=1, initial=0.0), 1e-300)[:, None] * EPS**2
        d = np.maximum(np.maximum(damp[active], diag), floor)
        damp[active] = d
        dl = damp_local[active]
        if blocks:
            dl = np.maximum(dl, now.al[:, :, np.arange(size), np.arange(size)])
            damp_local[active] = dl = np.maximum(dl, np.maximum(dl.max(axis=2, keepdims=True), 1e-300) * EPS**2)
        held = np.zeros((len(active), n), dtype=np.bool_)
        if bounded:
            value = here[:, problem.index]
            held = ((value <= lower) & (now.g > 0)) | ((value >= upper) & (now.g < 0))
        step, step_local = np.zeros((len(active), n)), np.zeros((len(active), blocks, size))
        predicted, good = np.zeros(len(active)), np.zeros(len(active), dtype=np.bool_)
        damped_step(now.a, now.g, now.al, now.gl, now.asl, lam[active], d, dl, held, step, step_local, predicted, good)
        if damping == 0.0:
            reason[active[~good]] = Reason.SINGULAR
        # Cosine between the residual and each column, in the metric that the solver sees.
        free_g = np.where(held, 0.0, now.g)
        cosine = np.abs(free_g / np.sqrt(d)).max(axis=1, initial=0.0)
        if blocks:
            cosine = np.maximum(cosine, np.abs(now.gl / np.sqrt(dl)).max(axis=(1, 2), initial=0.0))
        flat = cosine <= gradient_tolerance * np.sqrt(2 * now.cost) + 1e-300
        reason[active[flat]] = Reason.GRADIENT
        done = good & (predicted <= cost_tolerance * now.cost) & ~flat
        tiny = good & (np.abs(step) <= step_tolerance * problem.scales).all(axis=1) & ~flat & ~done
        if blocks:
            tiny &= (np.abs(step_local) <= step_tolerance).all(axis=(1, 2))
        reason[active[tiny]] = Reason.STEP
        new = problem.retract(here, step, step_local if blocks else None)
        if bounded:
            new[:, problem.index] = np.clip(new[:, problem.index], lower, upper)
        reason[active[done]] = Reason.COST
        trial = np.flatnonzero(good & ~flat & ~tiny & ~done)
        if not len(trial):
            lam[active[~good]] = np.maximum(lam[active[~good]], 1e-12) * 10
            reason[active[~good & (lam[active] > 1e12)]] = Reason.SINGULAR
            continue
        at = active[trial]
        result = problem.normal(new if len(trial) == batch else new[trial], at)
        decrease = normal.cost[at] - result.cost
        accept = np.isfinite(result.cost) & ((decrease > 0) | (damping == 0.0))
        ratio = decrease / np.maximum(predicted[trial], 1e-300)
        iterations[at] += 1
        lam[at] = np.where(
            accept,
            np.maximum(lam[at] * np.where(ratio > 0.9, 0.02, np.where(ratio > 0.5, 0.2, np.where(ratio > 0.25, 1.0, 4.0))), 0.0),
            np.maximum(lam[at], 1e-9) * grow[at],
        ) if damping else 0.0  # fmt: skip
        grow[at] = np.where(accept, 10.0, np.minimum(grow[at] * 2, 1e4))
        taken = at[accept]
        if len(taken) == batch:
            x, normal = new, result
        elif len(taken):
            x[taken] = new[trial[accept]]
            normal.put(taken, result.take(np.flatnonzero(accept)))
        bad = active[~good]
        lam[bad] = np.maximum(lam[bad], 1e-12) * 10
        reason[bad[lam[bad] > 1e12]] = Reason.SINGULAR
        stuck = at[~accept & (lam[at] > 1e14) & (reason[at] == Reason.RUNNING)]
        reason[stuck] = Reason.STALLED
        history.append(normal.cost.copy())
        if watch:
            watch({"stage": "iterate", "iteration": len(history) - 1, "cost": float(normal.cost[0]), "active": len(active)})
    reason[reason == Reason.RUNNING] = Reason.ITERATIONS
    return Solution(x, normal.cost, iterations, reason, np.array(history), normal)


def _pseudo_inverse(problem: Problem, x: Array, most: int, watch: Watch | None) -> Solution:
    if len(x) != 1 or problem.blocks:
        raise ModelError("the pseudo-inverse method solves one problem without local blocks", found=f"{len(x)} problems, {problem.blocks} blocks")
    history = []
    best, best_x = np.inf, x
    reason = Reason.ITERATIONS
    count = 0
    for count in range(most + 1):
        lin = problem.linearize(x)
        cost = 0.5 * float(lin.r @ lin.r)
        history.append([cost])
        if watch:
            watch({"stage": "iterate", "iteration": count, "cost": cost, "active": 1})
        if not np.isfinite(cost):
            reason = Reason.NOT_FINITE
            break
        if cost < best:
            best, best_x = cost, x
        elif most > 1 and count > 3:
            # At machine precision the cost only jitters; the best point seen is the answer.
            reason = Reason.COST
            break
        if count == most:
            break
        step = -np.linalg.pinv(lin.j, rcond=EPS * max(lin.j.shape)) @ lin.r
        x = problem.retract(x, step[None])
    if most == 1:
        best_x = x
    normal = problem.normal(best_x)
    return Solution(best_x, normal.cost, np.array([count]), np.array([int(reason)]), np.array(history), normal)
