"""Which measurements to take: a subset of candidates whose information is best by a criterion.

    M = M0 + sum_i A_i^T A_i        A_i (d, n) whitened Jacobian of candidate i, M0 what is known before

Greedy: add the best of all candidates, one at a time. Then exchange: excursions that add the best k and take the worst
k away again, or the other way round (DETMAX), and single swaps of every member for the best candidate (Fedorov). Only
a better set is accepted, so the result is never worse than the greedy start, and no single swap improves it.

How good could it be? A concave criterion phi lies below its tangents, so with any M* and any `count` candidates

    phi(M) <= phi(M*) + tr Phi'(M*) (M0 - M*) + count max_i tr A_i Phi'(M*) A_i^T

`limit` takes M* from the best weights on all candidates, found by multiplying each with its share of the slope.

Vectors only: nuisance parameters (frames, targets) are columns like the others, M0 holds 1 / expected^2
of each column, so that a small set is never singular, and the information of what was measured before. References:
Fedorov, Theory of optimal experiments (1972); Mitchell, An algorithm for the construction of D-optimal experimental
designs (Technometrics, 1974); Silvey, Titterington and
Torsney, An algorithm for optimal designs on a finite design space (1978) for the weights.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.errors import ModelError
from robocal.estimate.criteria import Criterion, information
from robocal.progress import Watch, tell

__all__ = ["Design", "exchange", "greedy", "limit", "select"]

CHUNK = 64  # candidates worked out together where the bound is not tight
LONGEST = 3  # excursion
BETTER = 1e-9  # relative to the value: less is rounding


@dataclass(frozen=True)
class Design:
    """Chosen candidates (count,), with the criterion's value; those of the greedy start; how many exchanges were
    accepted."""

    chosen: Ints
    value: float
    start: Ints
    start_value: float
    exchanges: int


def select(
    blocks: Array,
    count: int,
    criterion: Criterion,
    known: Array,
    *,
    allowed: Sequence[int] | Ints | None = None,
    watch: Watch | None = None,
) -> Design:
    """The best `count` of the candidates: blocks (m, d, n), known (n, n) positive definite; each is taken at most once.

    `allowed` are the candidates to choose from (default: all). Raises ModelError when there are too few.
    """
    free = np.ones(len(blocks), dtype=bool)
    if allowed is not None:
        free[:] = False
        free[np.asarray(allowed, dtype=np.int64)] = True
    start = greedy(blocks, count, criterion, known, free=free, watch=watch)
    start_value = float(criterion.value(_total(blocks, known, start)))
    chosen, exchanges = exchange(blocks, start, criterion, known, free=free, watch=watch)
    value = float(criterion.value(_total(blocks, known, chosen))) if exchanges else start_value
    return Design(np.array(chosen, dtype=np.int64), value, np.array(start, dtype=np.int64), start_value, exchanges)


def greedy(
    blocks: Array,
    count: int,
    criterion: Criterion,
    known: Array,
    *,
    free: Bools | None = None,
    watch: Watch | None = None,
) -> list[int]:
    """The best candidate given those already taken, `count` times, in this order. Raises ModelError when there are too
    few."""
    open_ = np.ones(len(blocks), dtype=bool) if free is None else free.copy()
    if count > int(open_.sum()):
        raise ModelError("there are fewer candidates than poses wanted", found=int(open_.sum()), expected=f"{count}")
    chosen: list[int] = []
    m = known.copy()
    for _ in range(count):
        at = np.flatnonzero(open_)
        best = int(at[_best(criterion, m, blocks if len(at) == len(blocks) else blocks[at], 1.0)])
        chosen.append(best)
        open_[best] = False
        m += information(blocks[best])
        tell(watch, "choosing poses", done=len(chosen), total=count)
    return chosen


def exchange(
    blocks: Array,
    chosen: Sequence[int],
    criterion: Criterion,
    known: Array,
    *,
    free: Bools | None = None,
    watch: Watch | None = None,
) -> tuple[list[int], int]:
    """A set that is at least as good, of the same size, and how many exchanges led there."""
    search = _Search(blocks, criterion, known, np.ones(len(blocks), dtype=bool) if free is None else free)
    best = list(chosen)
    value = float(criterion.value(_total(blocks, known, best)))
    accepted = 0

    def better(trial: list[int]) -> bool:
        nonlocal best, value, accepted
        new = float(criterion.value(_total(blocks, known, trial)))
        if len(trial) != len(best) or not new > value + BETTER * abs(value):
            return False
        best, value, accepted = trial, new, accepted + 1
        tell(watch, "exchanging poses", exchanges=accepted)
        return True

    length = 1
    while length <= min(LONGEST, len(best)):
        length = 1 if any(better(search.excursion(best, length, first)) for first in (1.0, -1.0)) else length + 1
    improved = True
    while improved:
        # A swap takes away its own member only, so the others of this round are still there.
        improved = sum(better(search.swap(best, member)) for member in list(best)) > 0
    return best, accepted


def limit(blocks: Array, count: int, criterion: Criterion, known: Array, *, rounds: int = 80) -> float | None:
    """No `count` of the candidates have a larger value than this; None for a criterion whose slope is not known."""
    m, d, n = blocks.shape
    flat = blocks.reshape(m * d, n)
    weight = np.full(m, count / m)
    best = np.inf
    for _ in range(rounds):
        total = known + flat.T @ (flat * np.repeat(weight, d)[:, None])
        slope = criterion.slope(total)
        if slope is None:
            return None
        gain = np.sum((flat @ slope).reshape(m, -1) ** 2, axis=1)
        missing = count * float(gain.max()) - float(weight @ gain)
        best = min(best, float(criterion.value(total)) + missing)
        weight *= np.sqrt(gain)
        weight *= count / weight.sum()
    return best


@dataclass(frozen=True)
class _Search:
    """Steps from one set to another."""

    blocks: Array
    criterion: Criterion
    known: Array
    free: Bools

    def excursion(self, chosen: Sequence[int], length: int, first: float) -> list[int]:
        """`length` additions of the best and as many removals of the worst, additions first when `first` is 1."""
        trial = list(chosen)
        for sign in (first, -first):
            for _ in range(length):
                if sign > 0:
                    trial = self.add(trial)
                else:
                    m = _total(self.blocks, self.known, trial)
                    trial.pop(_best(self.criterion, m, self.blocks[trial], -1.0))
        return trial

    def swap(self, chosen: Sequence[int], member: int) -> list[int]:
        """The set with one member replaced by the best candidate, which may be itself."""
        return self.add([i for i in chosen if i != member])

    def add(self, chosen: list[int]) -> list[int]:
        """The set with the best candidate that it does not hold; unchanged when there is none."""
        open_ = self.free.copy()
        open_[chosen] = False
        at = np.flatnonzero(open_)
        if not len(at):
            return chosen
        m = _total(self.blocks, self.known, chosen)
        return [*chosen, int(at[_best(self.criterion, m, self.blocks[at], 1.0)])]


def _total(blocks: Array, known: Array, chosen: Sequence[int] | Ints) -> Array:
    """Summed afresh each time, so that rounding never adds up."""
    rows = blocks[np.asarray(chosen, dtype=np.int64)].reshape(-1, blocks.shape[-1])
    return np.asarray(known + rows.T @ rows)


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
