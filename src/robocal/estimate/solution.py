"""Where a solver ended, and why."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from functools import cached_property
from typing import Self

from robocal._record import record
from robocal._types import Array, Ints
from robocal.estimate.terms import Normal

__all__ = ["Reason", "Solution"]

SETTLED = 1e-6


class Reason(IntEnum):
    """Why an iteration stopped, and the same in words for people."""

    text: str

    RUNNING = 0, "still running"
    # The model promises no decrease that could be told from rounding.
    COST = 1, "converged: no further decrease"
    # The residual is orthogonal to every column.
    GRADIENT = 2, "converged: gradient is zero"
    # The step is below the resolution of x.
    STEP = 3, "converged: step is zero"
    ITERATIONS = 4, "stopped: too many iterations"
    # No damping makes the matrix positive definite.
    SINGULAR = 5, "stopped: singular"
    # The cost at the start is not a number.
    NOT_FINITE = 6, "stopped: the residuals are not finite"
    STALLED = 7, "stopped: no step lowers the cost"
    # No iteration was asked for.
    FILTERED = 8, "every configuration was taken in"
    TOLERANCE = 9, "stopped: the greatest error is within the tolerance"

    def __new__(cls, number: int, text: str = "") -> Self:
        made = int.__new__(cls, number)
        made._value_, made.text = number, text
        return made

    @property
    def converged(self) -> bool:
        """Whether the result is a minimum, or all that was asked for."""
        return self in (Reason.COST, Reason.GRADIENT, Reason.STEP, Reason.FILTERED, Reason.TOLERANCE)


@record
class Solution:
    """Where a solver ended: x (B, P), cost (B,), iterations (B,), reason (B,), history of costs (iterations + 1, B)
    and the normal equations, of parts of the batch; those of robust losses are computed on request."""

    x: Array
    cost: Array
    iterations: Ints
    reason: Ints
    history: Array
    parts: tuple[Normal | Callable[[], Normal], ...]

    @cached_property
    def normal(self) -> Normal:
        """The normal equations of the whole batch."""
        parts = [p if isinstance(p, Normal) else p() for p in self.parts]
        return parts[0] if len(parts) == 1 else Normal.concatenate(parts)

    @property
    def reasons(self) -> tuple[Reason, ...]:
        """The reasons as an enum."""
        return tuple(Reason(int(r)) for r in self.reason)

    def settled(self, which: int = 0) -> bool:
        """Whether one of the problems came to its end, or so near it that the last iteration lowered the cost by less than `SETTLED`
        of it: along a valley whose residuals are large, steps stay short for hundreds of iterations."""
        last = self.history[-2:, which]
        near = len(last) > 1 and last[0] - last[1] <= SETTLED * last[1]
        return self.reasons[which].converged or (self.reason[which] == Reason.ITERATIONS and bool(near))
