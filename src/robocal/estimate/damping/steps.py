"""The steps of a batch of problems: one compiled call where they are small, one reduced system each where they are large."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.estimate.problem import Problem
from robocal.estimate.terms import Normal

__all__ = ["Steps"]

LARGE = 96  # free columns from which LAPACK is worth its call
ONE = np.ones(1)


def _blocks(problem: Problem, batch: int) -> tuple[Array, Array]:
    if not problem.families:
        return _nothing(batch)
    one, two = (np.zeros((batch, *size)) for size in problem.sizes)
    return one, two


@cache
def _nothing(batch: int) -> tuple[Array, Array]:
    return np.empty((batch, 0, 0)), np.empty((batch, 0, 0))


@cache
def _proposing() -> tuple[Callable[..., int], int]:
    """The kernel that proposes, and its word for a cost that is no number: an import costs as much as a small kernel."""
    from robocal.estimate.damping._kernels import NOT_FINITE, propose

    return propose, NOT_FINITE


class Steps:
    """The damping and the last step of every problem of a batch: step (B, n), and of the blocks of both families (B, L, l);
    length (B,) is the square of the step that led a problem away."""

    def __init__(self, problem: Problem, batch: int, tolerances: Array, damped: bool) -> None:
        n = problem.n
        self._propose, self._not_finite = _proposing()
        self.tolerances, self.damped = tolerances, damped
        self.lower, self.upper = problem.bounds
        self.scales = problem.scales
        self.damp, self.step, self.length = np.zeros((batch, n)), np.zeros((batch, n)), np.zeros(batch)
        self.damp_local, self.local = _blocks(problem, batch), _blocks(problem, batch)
        self.blocks = problem.sizes[0][1] > 0
        large = n > LARGE or problem.sizes[1][1] > 0
        self.system = None
        if large:
            from robocal.estimate.schur.arrowhead import system_of

            self.system = system_of(problem)

    def propose(self, normal: Normal, value: Array, away: Bools, lam: Array, predicted: Array, reason: Ints) -> int:
        """For every running problem: scale, hold columns at their bounds, solve, and say why to stop, in `reason` (B,); see
        `_kernels.propose`. Returns how many go on."""
        if self.system is None:
            blocks = (normal.gl, normal.al, normal.asl, self.damp_local[0], self.local[0]) if self.blocks else None
            going: int = self._propose(
                normal.cost, normal.g, normal.a, blocks, value, self.lower, self.upper, self.scales, self.tolerances, self.damped,
                away, self.length, lam, self.damp, self.step, predicted, reason,
            )  # fmt: skip
            return going
        reason[(reason == 0) & ~np.isfinite(normal.cost)] = self._not_finite
        for b in np.flatnonzero(reason == 0).tolist():
            self._one(b, normal, value[b], away, lam, predicted, reason)
        return int((reason == 0).sum())

    def _one(
        self, b: int, normal: Normal, value: Array, away: Bools, lam: Array, predicted: Array, reason: Ints
    ) -> None:
        from robocal.estimate.damping._kernels import GRADIENT, judge, promised, scale_blocks, scale_columns

        assert self.system is not None
        cost, held = normal.cost[b], np.zeros(self.step.shape[1], dtype=np.bool_)
        worst = scale_columns(
            cost, normal.g[b], normal.a[b], value, self.lower, self.upper, self.scales, self.damp[b], held
        )
        for i in (0, 1):
            worst = scale_blocks(normal.of_family(i)[0][b], normal.of_family(i)[1][b], self.damp_local[i][b], worst)
        if not away[b] and worst <= self.tolerances[1] * np.sqrt(2.0 * cost) + 1e-300:
            reason[b] = GRADIENT
            return
        before, failed = lam[b], False
        local, steps = ((part[0][b], part[1][b]) for part in (self.damp_local, self.local))
        while not self.system.solve(normal, b, lam[b], self.damp[b], local, held, self.step[b], steps):
            lam[b] = max(lam[b], 1e-12) * 10.0
            failed = not (self.damped and lam[b] <= 1e12)
            if failed:
                break
        least = self.tolerances[2]
        parts = [promised(self.step[b], normal.g[b], lam[b], self.damp[b], self.scales, least)]
        for i in (0, 1):
            g = normal.of_family(i)[0][b].ravel()
            parts.append(promised(steps[i].ravel(), g, lam[b], local[i].ravel(), ONE, least))
        far, gain = (float(sum(part[i] for part in parts)) for i in (0, 1))
        reason[b], lam[b], self.length[b], predicted[b] = judge(
            far, gain, all(part[2] for part in parts), failed, cost, self.tolerances, away[b], before, self.length[b], lam[b],
            predicted[b],
        )  # fmt: skip
