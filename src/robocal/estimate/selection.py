"""Which measurements to take: a subset of candidates whose information is best by a criterion.

    M = M0 + sum_i A_i^T A_i        A_i (d, n) whitened Jacobian of candidate i, M0 what is known before

Greedy: add the best of all candidates, one at a time. Then exchange: excursions that add the best k and take the worst
k away again, or the other way round (DETMAX), and single swaps of every member for the best candidate (Fedorov). Only
a better set is accepted, so the result is never worse than the greedy start, and no single swap improves it.

How good could it be? A concave criterion phi lies below its tangents, so with any M* and any `count` candidates

    phi(M) <= phi(M*) + tr Phi'(M*) (M0 - M*) + count max_i tr A_i Phi'(M*) A_i^T

`Pool.limit` takes M* from the best weights on all candidates, found by multiplying each with its share of the slope.

Vectors only: nuisance parameters (frames, targets) are columns like the others, M0 holds 1 / expected^2
of each column, so that a small set is never singular, and the information of what was measured before. References:
Fedorov, Theory of optimal experiments (1972); Mitchell, An algorithm for the construction of D-optimal experimental
designs (Technometrics, 1974); Silvey, Titterington and
Torsney, An algorithm for optimal designs on a finite design space (1978) for the weights.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import record
from robocal._types import Array, Bools, Ints
from robocal.errors import ModelError
from robocal.estimate.criteria import Criterion, information
from robocal.progress import Watch, tell

__all__ = ["Design", "Pool"]

CHUNK = 64  # candidates worked out together where the bound is not tight
LONGEST = 3  # excursion
BETTER = 1e-9  # relative to the value: less is rounding


@record
class Design:
    """Chosen candidates (count,), with the criterion's value; those of the greedy start; how many exchanges were
    accepted."""

    chosen: Ints
    value: float
    start: Ints
    start_value: float
    exchanges: int


@record
class Pool:
    """Candidates to choose from: blocks (m, d, n), known (n, n) positive definite, and which may be taken, (m,) (None: all); each is
    taken at most once."""

    blocks: Array
    criterion: Criterion
    known: Array
    free: Bools | None = None
    watch: Watch | None = None

    def select(self, count: int) -> Design:
        """The best `count` of the candidates. Raises ModelError when there are too few."""
        start = self.greedy(count)
        start_value = self._value(start)
        chosen, exchanges = self.exchange(start)
        value = self._value(chosen) if exchanges else start_value
        return Design(np.array(chosen, dtype=np.int64), value, np.array(start, dtype=np.int64), start_value, exchanges)

    def greedy(self, count: int) -> list[int]:
        """The best candidate given those already taken, `count` times, in this order. Raises ModelError when there are too
        few."""
        there = len(self._open(()))
        if count > there:
            raise ModelError("there are fewer candidates than poses wanted", found=there, expected=f"{count}")
        chosen: list[int] = []
        m = self.known.copy()
        for _ in range(count):
            chosen.append(self._best_of(self._open(chosen), m))
            m += information(self.blocks[chosen[-1]])
            tell(self.watch, "choosing poses", done=len(chosen), total=count)
        return chosen

    def exchange(self, chosen: Sequence[int]) -> tuple[list[int], int]:
        """A set that is at least as good, of the same size, and how many exchanges led there."""
        best = list(chosen)
        value, accepted = self._value(best), 0

        def better(trial: list[int]) -> bool:
            nonlocal best, value, accepted
            new = self._value(trial)
            if len(trial) != len(best) or not new > value + BETTER * abs(value):
                return False
            best, value, accepted = trial, new, accepted + 1
            tell(self.watch, "exchanging poses", exchanges=accepted)
            return True

        length = 1
        while length <= min(LONGEST, len(best)):
            length = 1 if any(better(self._excursion(best, length, first)) for first in (1.0, -1.0)) else length + 1
        improved = True
        while improved:
            # A swap takes away its own member only, so the others of this round are still there; the best may be itself.
            swaps = (better(self._add([i for i in best if i != member])) for member in list(best))
            improved = sum(swaps) > 0
        return best, accepted

    def limit(self, count: int, *, rounds: int = 80) -> float | None:
        """No `count` of the candidates have a larger value than this; None for a criterion whose slope is not known."""
        m, d, n = self.blocks.shape
        flat = self.blocks.reshape(m * d, n)
        weight = np.full(m, count / m)
        best = np.inf
        for _ in range(rounds):
            total = self.known + flat.T @ (flat * np.repeat(weight, d)[:, None])
            slope = self.criterion.slope(total)
            if slope is None:
                return None
            gain = np.sum((flat @ slope).reshape(m, -1) ** 2, axis=1)
            missing = count * float(gain.max()) - float(weight @ gain)
            best = min(best, float(self.criterion.value(total)) + missing)
            weight *= np.sqrt(gain)
            weight *= count / weight.sum()
        return best

    def _excursion(self, chosen: Sequence[int], length: int, first: float) -> list[int]:
        """`length` additions of the best and as many removals of the worst, additions first when `first` is 1."""
        trial = list(chosen)
        for sign in np.repeat([first, -first], length):
            if sign > 0:
                trial = self._add(trial)
            else:
                trial.pop(_best(self.criterion, self._total(trial), self.blocks[trial], -1.0))
        return trial

    def _add(self, chosen: list[int]) -> list[int]:
        """The set with the best candidate that it does not hold; unchanged when there is none."""
        at = self._open(chosen)
        return [*chosen, self._best_of(at, self._total(chosen))] if len(at) else chosen

    def _open(self, chosen: Sequence[int]) -> Ints:
        """The candidates that may be taken still."""
        open_ = np.ones(len(self.blocks), dtype=bool) if self.free is None else self.free.copy()
        open_[list(chosen)] = False
        return np.flatnonzero(open_)

    def _best_of(self, at: Ints, m: Array) -> int:
        """The best of some candidates beside what m says."""
        blocks = self.blocks if len(at) == len(self.blocks) else self.blocks[at]
        return int(at[_best(self.criterion, m, blocks, 1.0)])

    def _total(self, chosen: Sequence[int]) -> Array:
        """Summed afresh each time, so that rounding never adds up."""
        rows = self.blocks[np.asarray(chosen, dtype=np.int64)].reshape(-1, self.blocks.shape[-1])
        return np.asarray(self.known + rows.T @ rows)

    def _value(self, chosen: Sequence[int]) -> float:
        return float(self.criterion.value(self._total(chosen)))


def _best(criterion: Criterion, m: Array, blocks: Array, sign: float) -> int:
    """The block whose addition (sign 1) or removal (-1) leaves the largest value; among equals the first."""
    bound = criterion.bound(m, blocks, sign)
    if criterion.tight:
        return int(np.argmax(bound))
    order = np.argsort(-bound, kind="stable")
    best, top = int(order[0]), -np.inf
    for first in range(0, min(len(order), criterion.most), CHUNK):
        part = order[first : first + CHUNK]
        if bound[part[0]] <= top:
            break
        value = criterion.after(m, blocks[part], sign)
        i = int(np.argmax(value))
        if value[i] > top:
            best, top = int(part[i]), float(value[i])
    return best
