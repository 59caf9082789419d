"""How far a robot has changed, in millimetres over the places of interest, with an interval.

    d^2 = mean over places |p_2 - p_1|^2 = |X step|^2,   X step ~ N(D v, X cov X^T)

p are the two models' predictions once the base (and a new tool) is placed best; X (w, n) turns parameters into what shows at
the places. D is the change as people measure it, the mean distance, v the direction in which it went: nobody knows it, so
it is drawn: one parameter alone, or all at once, each by as much as shows. The interval are the sizes D whose d is not too
rare: P(d' >= d | low) = P(d' <= d | high) = 2.5 %, and `high` is never below what a typical equal pair would give: two
runs that agree better than they should are luck, and no knowledge (power-constrained limits). Source of the latter:
Cowan, Cranmer, Gross, Vitells, Power-constrained limits (2011).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from robocal._record import record
from robocal._types import Array
from robocal.estimate.uncertainty import LEVEL
from robocal.geometry import fits
from robocal.measure.machine import Model
from robocal.measure.reach import reach
from robocal.prove.place_bands import motion_field
from robocal.quantities import Amount

__all__ = ["ModelDifference", "Shows", "model_difference", "shows"]

DRAWS = 20_000
DIRECTIONS = 1000
HALVINGS = 40
UNSEEN = 1e-9  # of the largest singular value: no direction of the workspace
MOST_RUNS = 64  # times as many poses as there were: further than that nobody measures


@record
class ModelDifference:
    """How far the robot has changed (m): `change` is the size at which as much would be seen half of the time, mean over
    the places, `low` to `high` its 95 % interval, p_value the chance of as much without a change.

    rms and largest distance of the two models' predictions as they are, the rms expected without a change and its 95 %
    limit, and where it is largest. `more`: how many times as many poses would settle on which side of what matters the change
    is, None where that cannot be told.
    """

    change: Amount
    low: Amount
    high: Amount
    p_value: float
    rms: Amount
    largest: Amount
    expected: Amount
    limit: Amount
    place: tuple[Amount, Amount, Amount]
    joints: tuple[float, ...]
    n: int
    more: float | None = None


@record
class Shows:
    """What shows at n places: X (w, n names), the predictions' distances gap (m, 3), directions of a change (k, w), each of a
    mean distance of one, and the predicted places (m, 3)."""

    x: Array
    gap: Array
    directions: Array
    here: Array


def shows(
    first: Model, second: Model, names: Sequence[str], joints: Array, conditions: Mapping[str, float], *,
    new_tool: bool = False,
) -> Shows:  # fmt: skip
    """What a change of the named parameters does at joint values (m, q), the base placed best (`new_tool`: the tool too)."""
    if new_tool:
        tool = {n: first.table[n].value for n in first.table.names if n.startswith("tool.")}
        second = second.with_values(tool)
    pose, moves = reach(first, joints, names, conditions, turn=False)
    here, there = pose[:, :3, 3], reach(second, joints, (), conditions, turn=False)[0][:, :3, 3]
    t = fits.rigid(there, here)
    gap = there @ t[:3, :3].T + t[:3, 3] - here
    field = motion_field(here)[:, :3]
    if new_tool:
        field = np.concatenate([field, pose[:, :3, :3]], axis=2)
    flat = field.reshape(-1, field.shape[2])
    both = np.column_stack([gap.ravel(), moves.reshape(len(flat), -1)])
    both = both - flat @ np.linalg.lstsq(flat, both, rcond=None)[0]
    gap, jac = both[:, 0].reshape(-1, 3), both[:, 1:]
    _, values, vt = np.linalg.svd(jac / np.sqrt(len(gap)), full_matrices=False)
    keep = values > UNSEEN * values.max(initial=0.0)
    # X^T X = J^T J / n whatever the signs; these are the same on every machine.
    signs = np.sign(vt[np.arange(len(vt)), np.argmax(np.abs(vt), axis=1)])
    x = (signs * values)[keep, None] * vt[keep]
    return Shows(x, gap, _directions(jac, x), here)


def _directions(jac: Array, x: Array) -> Array:
    """Changes of one parameter alone, in turn, and of all at random, each by as much as shows; mean distance one."""
    shown = np.linalg.norm(x, axis=0)
    able = np.flatnonzero(shown > UNSEEN * shown.max(initial=0.0))
    if not len(able):
        return np.zeros((0, len(x)))
    rng = np.random.default_rng(1)
    step = np.zeros((2 * DIRECTIONS, x.shape[1]))
    step[np.arange(DIRECTIONS), able[np.arange(DIRECTIONS) % len(able)]] = rng.choice([-1.0, 1.0], DIRECTIONS)
    step[DIRECTIONS:, able] = rng.standard_normal((DIRECTIONS, len(able)))
    step[:, able] /= shown[able]
    mean = np.zeros(len(step))
    for part in np.array_split(np.arange(len(step)), 20):
        mean[part] = np.linalg.norm((step[part] @ jac.T).reshape(len(part), -1, 3), axis=2).mean(axis=1)
    return np.asarray(step @ x.T / mean[:, None])


def model_difference(
    seen: Shows, noise: Array, hidden: Array, dof: float, joints: Array, matters: float
) -> ModelDifference:
    """The change and its interval; `noise` and `hidden` (n, n) are the covariances of the step from one run to the other, the
    first falls with the number of poses."""
    size = np.linalg.norm(seen.gap, axis=1)
    square = float(np.mean(size**2))
    rng = np.random.default_rng(0)
    white = rng.standard_normal((DRAWS, len(seen.x)))
    if np.isfinite(dof):
        white *= np.sqrt(dof / rng.chisquare(dof, DRAWS))[:, None]
    turn = np.resize(np.arange(len(seen.directions)), DRAWS)
    one = _Sizes(seen, noise + hidden, white, turn)
    change, low, high = one.interval(square)

    def settles(times: float) -> bool:
        """Whether so many times as many poses would bring the interval to one side of what matters, were the change what it seems.
        What selection hides is taken to fall like the noise: more poses show more columns."""
        some = _Sizes(seen, (noise + hidden) / times, white, turn)
        _, low, high = some.interval(max(square - one.expected, 0.0) + some.expected)
        return high <= matters or low > matters

    more = 1.0 if high <= matters or low > matters else _fewest(settles)
    chance = float((1 + np.sum(one.none >= square)) / (1 + DRAWS))
    rms, expected, limit = np.sqrt([square, one.expected, np.percentile(one.none, 100 * LEVEL)]).tolist()
    worst = int(np.argmax(size))
    x, y, z = seen.here[worst].tolist()
    return ModelDifference(
        change, low, high, chance, rms, float(size[worst]), expected, limit, (x, y, z), tuple(joints[worst].tolist()), len(size), more,
    )  # fmt: skip


def _fewest(settles: Callable[[float], bool]) -> float | None:
    """How many times as many poses do, within a tenth; None where `MOST_RUNS` do not."""
    if not settles(MOST_RUNS):
        return None
    low, high = 1.0, float(MOST_RUNS)
    while high > 1.1 * low:
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if settles(middle) else (middle, high)
    return high


class _Sizes:
    """The distribution of d^2 for every size of a change, from one set of draws."""

    def __init__(self, seen: Shows, covariance: Array, white: Array, turn: NDArray[np.int64]) -> None:
        values, vectors = np.linalg.eigh(seen.x @ covariance @ seen.x.T)
        # The symmetric root is the one that has no signs and turns to choose: the same draws show the same of any factor.
        noise = white @ (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
        self.none = np.einsum("ki,ki->k", noise, noise)
        self.expected = float(np.maximum(values, 0.0).sum())
        v = seen.directions
        self.able = bool(len(v))
        self.square = np.einsum("ki,ki->k", v, v)[turn] if self.able else np.zeros(len(white))
        self.cross = np.einsum("ki,ki->k", v[turn], noise) if self.able else np.zeros(len(white))

    def below(self, size: float, square: float) -> float:
        """The chance of no more than this square after a change of this size."""
        return float(np.mean(size * (size * self.square + 2 * self.cross) + self.none <= square))

    def size(self, chance: float, square: float) -> float:
        """The size at which no more than this square has this chance; 0 where it is rarer without a change."""
        if not self.able or self.below(0.0, square) <= chance:
            return 0.0
        low, high = 0.0, np.sqrt(square)
        while self.below(high, square) > chance:
            low, high = high, 2 * high
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.below(middle, square) > chance else (low, middle)
        return float(high)

    def interval(self, square: float) -> tuple[float, float, float]:
        """Estimate and 95 % interval of the size."""
        tail = 0.5 * (1 - LEVEL)
        least = max(square, float(np.median(self.none)))
        return self.size(0.5, square), self.size(1 - tail, square), self.size(tail, least)
