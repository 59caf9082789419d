"""Which single change, if any, explains data that the nominal arm does not.

    1 as stated     frames, things on the tool and, softly held, the arm itself: does the misfit ask for it?
    2 frames alone  every change in one batch; the few best go on
    3 softly held   these, as stated, and as stated with the joints' zeros free, for lost mastering is normal

A change is named when it leaves what an arm's making leaves (a hundredth of its reach), a fifth of what is left without it
and a fifth of what other zeros of the joints would leave. Changes that end at the same misfit are told together: with
free frame and target they cannot be told apart. What does no harm lowers nothing and is never named.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from robocal._record import record
from robocal._types import Array
from robocal.diagnose import limits
from robocal.diagnose.hypotheses.changes import WHOLE, Change, Trial, What, apply_all
from robocal.diagnose.hypotheses.lockstep import SoftPrior, fit_trials, reach_of
from robocal.diagnose.hypotheses.sights import Sights, rows_of, sights, taken
from robocal.diagnose.hypotheses.two_changes import one_change_linear, two_changes
from robocal.measure.data import DataSet
from robocal.measure.machine import Mechanism

__all__ = [
    "LOST",
    "SOFT",
    "Doubt",
    "Explanation",
    "alike",
    "assess_misfit",
    "explain",
    "explain_beside",
    "finite_sights",
    "left_of",
    "left_softly",
]

BEST = 10  # how many of a batch are looked at again
SOFT, LOST = 0.03, 1.0  # rad: how far a joint's zero may be off as a matter of course, and when its mastering is lost
GAINS = (1.0, 1.6, 2.4, 3.6)  # grid: gains from which a fit begins that all joints have alike


@record
class Explanation:
    """Changes that explain the data, alike, the plainest first; what is left as stated and with them (m)."""

    changes: tuple[Trial, ...]
    stated: float
    left: float


@record
class Doubt:
    """Data whose misfit asks for a change: rows of every instrument, what is left as stated and with the joints' zeros
    lost (m), the reach (m), and whether the joints stood at too few places for anything but another arm."""

    rows: list[NDArray[np.int64]]
    stated: float
    lost: float
    reach: float
    few: bool

    def explains(self, left: float, reach: float | None = None) -> bool:
        """Whether this is little enough to explain the data, of an arm with another reach too."""
        clearly = left * limits.EXPLAINED_CLEARLY <= min(self.stated, self.lost)
        return clearly and left <= limits.MAKING_LEAVES * (self.reach if reach is None else reach)


def assess_misfit(chain: Mechanism, data: DataSet) -> Doubt | None:
    """Whether the misfit asks for a change; None where it does not or nobody can tell."""
    rows = rows_of(data)
    if rows is None:
        return None
    stated = finite_sights(chain, taken(data, rows))
    if stated is None:
        return None
    reach = reach_of(chain, stated)
    if reach > limits.ARM_LONGEST:  # of an arm in another unit, what was read has the right size
        reach = min(reach, limits.REACH_OF_SPREAD * float(stated.spread[0]))
    asks = limits.MISFIT_ASKS * reach
    with np.errstate(all="ignore"):
        # Most data ask for nothing as soon as frames stand.
        left = float(fit_trials(chain, stated, enough=asks).left[0])
        left = left if left <= asks else min(left, left_softly(chain, stated))
        if left <= asks:
            return None
        lost = _rms_without_mastering(chain, stated, left)
        return Doubt(rows, left, lost, reach, few=stated.places < limits.HYPOTHESIS_PLACES)


def explain(
    chain: Mechanism, data: DataSet, changes: Sequence[Change], doubt: Doubt | None = None, *, alone: bool = False
) -> Explanation | None:
    """The changes that explain the data: one, or two where one leaves too much (not where `alone`); None where nothing asks for
    one, or none does."""
    doubt = doubt or assess_misfit(chain, data)
    if doubt is None or doubt.few:
        return None
    small = taken(data, doubt.rows)
    found: Explanation | None = None
    with np.errstate(all="ignore"):
        stages = (lambda: two_changes(chain, data, doubt.rows, changes), lambda: _gains(chain, small, doubt))
        for make in (lambda: [(c,) for c in changes], *(() if alone else stages)):
            # What still leaves as much as asks for a change may be one of two.
            if found is not None and found.left <= limits.MISFIT_ASKS * doubt.reach:
                return found
            trials = make()
            order, left = _best(chain, data, small, doubt.rows, trials, doubt.stated) if trials else ([], np.zeros(0))
            best = float(left[order[0]]) if order else math.inf
            clearly = found is None or best * limits.EXPLAINED_CLEARLY <= found.left
            if doubt.explains(best) and clearly:
                found = Explanation(tuple(trials[i] for i in order if alike(left[i], best)), doubt.stated, best)
    return found


def explain_beside(
    chain: Mechanism, data: DataSet, changes: Sequence[Change], doubt: Doubt
) -> tuple[float, Callable[[], Explanation | None]]:
    """What a linear form leaves of another arm with one change, as a share of the spread; and the changes that explain the data with that
    arm, when they are asked for."""
    trials, rough = one_change_linear(chain, data, doubt.rows, changes)

    def look() -> Explanation | None:
        small = taken(data, doubt.rows)
        first = finite_sights(chain, small)
        if first is None or not trials:
            return None
        with np.errstate(all="ignore"):
            order, left = _best(chain, data, small, doubt.rows, trials, doubt.stated)
            if order and doubt.explains(best := float(left[order[0]]), reach_of(chain, first)):
                return Explanation(tuple(trials[i] for i in order if alike(left[i], best)), doubt.stated, best)
        return None

    return rough, look


def _gains(chain: Mechanism, small: DataSet, doubt: Doubt) -> list[Trial]:
    """A gain and a zero of every turning joint, by a fit from some gains that all may have: joints that are no angles at all."""
    turning = tuple(i for i, j in enumerate(chain.joints) if j.type != "prismatic" and f"{j.name}.gain" in chain.table)
    seen = finite_sights(chain, small)
    if seen is None or not turning:
        return []
    soft = SoftPrior.of_chain(chain, LOST)
    names = tuple(f"{chain.joints[i].name}.gain" for i in turning)
    prior = SoftPrior((*soft.names, *names), np.append(soft.sigma, np.full(len(names), LOST)), soft.zeros)
    own = np.array([chain.table[n].value for n in names])
    # tolerance: where a header says rad, a hundred is far more than any turn
    unit = math.radians(1.0) if float(np.abs(seen.joints).max()) > 20.0 else 1.0
    ends = np.array([(chain.joints[i].lower, chain.joints[i].upper) for i in turning])
    starts = [(np.full(len(turning), unit * g), np.zeros(len(turning))) for g in GAINS]
    if np.isfinite(ends).all():  # from -100 to 100 between the limits of each joint
        starts.append((unit * (ends[:, 1] - ends[:, 0]) / 2 / math.radians(100.0), ends.mean(axis=1)))
    best, found = math.inf, None
    for gains, zeros in starts:
        begun = Change(What.GAINS, turning, factors=tuple(gains), zeros=tuple(zeros)).apply(small)
        tried = finite_sights(chain, begun)
        assert tried is not None
        made = fit_trials(chain, tried, prior, rounds=30)
        if made.left[0] < best:
            moved = made.values[0, [chain.table.index[n] for n in names]] / own
            there = (zeros + made.zeros[0, list(turning)]) * moved
            best = float(made.left[0])
            found = Change(What.GAINS, turning, factors=tuple(gains * moved), zeros=tuple(there))
    wrong = found is not None and float(np.median(np.abs(np.array(found.factors) - 1.0))) > limits.GAIN_WRONG
    return [(found,)] if found is not None and wrong and doubt.explains(best) else []


def alike(left: float, best: float) -> bool:
    """Whether two misfits (m) are not told apart."""
    return left <= limits.EXPLANATIONS_ALIKE * best + 1e-9


def left_of(chain: Mechanism, data: DataSet, doubt: Doubt) -> float:
    """What another arm leaves of the same rows (m); inf where it explains nothing, or nobody can tell."""
    seen = finite_sights(chain, taken(data, doubt.rows))
    if seen is None or seen.places < limits.HYPOTHESIS_PLACES:
        return math.inf
    with np.errstate(all="ignore"):
        left = left_softly(chain, seen)
        # An arm so small that anything meets its readings is explained by nothing.
        small_enough = left <= limits.LEFT_OF_SPREAD * float(seen.spread[0])
        return left if small_enough and doubt.explains(left, reach_of(chain, seen)) else math.inf


def left_softly(chain: Mechanism, seen: Sights) -> float:
    """What a softly held arm leaves of one trial (m)."""
    return float(fit_trials(chain, seen, SoftPrior.of_chain(chain, SOFT)).left[0])


def finite_sights(chain: Mechanism, data: DataSet) -> Sights | None:
    """The data as one trial; None where they have another form, or numbers are missing."""
    seen = sights(chain, [data])
    known = seen is not None and np.isfinite(seen.joints).all() and np.isfinite(seen.place).all()
    return seen if known else None


def _rms_without_mastering(chain: Mechanism, stated: Sights, as_stated: float) -> float:
    """What is left with the joints' zeros free; where these end near right angles, that is no lost mastering."""
    free = fit_trials(chain, stated, SoftPrior.of_chain(chain, LOST), rounds=20)
    turning = np.array([j.type != "prismatic" for j in chain.joints])
    zeros = free.zeros[0][turning]
    quarter = np.abs(zeros - np.round(zeros / (math.pi / 2)) * (math.pi / 2))
    square = np.abs(np.round(zeros / (math.pi / 2))).sum() > 0 and quarter.max(initial=0.0) < limits.QUARTER_TURN_NEAR
    return as_stated if square else float(free.left[0])


def _best(
    chain: Mechanism,
    data: DataSet,
    small: DataSet,
    rows: list[NDArray[np.int64]],
    trials: Sequence[Trial],
    stated: float,
) -> tuple[list[int], Array]:
    """The few best of a batch in order, and what each of the batch leaves; inf where it was not looked at again,
    or leaves as large a share of what it reads as is left (m) as `stated`."""
    whole = [any(change.what in WHOLE for change in trial) for trial in trials]
    made = [taken(apply_all(t, data), rows) if w else apply_all(t, small) for t, w in zip(trials, whole, strict=True)]
    seen = sights(chain, made)
    assert seen is not None
    rough = fit_trials(chain, seen, rounds=3).left
    few = np.argsort(rough, kind="stable")[:BEST]
    first = sights(chain, [small])
    assert first is not None
    left = np.full(len(trials), np.inf)
    again = fit_trials(chain, seen.take(few), SoftPrior.of_chain(chain, SOFT))
    # Readings made so small that anything meets them are explained by nothing.
    small_enough = again.left <= limits.LEFT_OF_SPREAD * again.spread
    # Where the arm has no lengths, a smaller unit makes everything smaller, what is left like what was read.
    as_read = again.left * first.spread[0] / again.spread
    left[few] = np.where(small_enough & (as_read * limits.EXPLAINED_CLEARLY <= stated), again.left, np.inf)
    return [int(i) for i in np.argsort(left, kind="stable") if np.isfinite(left[i])], left
