"""Rows of one file that do not belong to its others: readings that stand rows off their joint values from one row on, or that another
robot gave.

    1 ends      the first and the last quarter of a file, each as stated and shifted, the arm softly held
    2 seam      by the end that fits as stated: from which row on the other reading of the rows fits better
    3 turns     every other row alone, where all rows together fit nowhere

A part that fits as stated beside the others is of this robot: the instrument or the target was moved (`segments/`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.diagnose import limits
from robocal.diagnose.check_registry import Finding, Given, Machines, When, check, refuse
from robocal.diagnose.hypotheses.explain import LOST, SOFT, finite_sights
from robocal.diagnose.hypotheses.lockstep import SoftPrior, fit_trials, reach_of, transfer
from robocal.diagnose.hypotheses.reading import ReadContext
from robocal.diagnose.hypotheses.sights import Sights, sights, usable
from robocal.measure.data import DataSet, Observations
from robocal.measure.machine import Mechanism
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["OTHER_ROBOT", "ROWS_OFF", "TURNS", "parts_differ"]

SHIFTS = (0, 1, -1, 2, -2, 3, -3)
MOST = 40  # rows of a part that are looked at
ROWS_OFF = declare(
    "rows-off",
    "from row {first} to row {last} each reading stands {shift} {where} its joint values: with that, their residual falls from "
    "{stated:.3g} to {left:.3g}",
    "Move the joint columns of these rows {way} by {shift}. Leave out the rows that have no partner then.",
)
OTHER_ROBOT = declare(
    "rows-of-another-robot",
    "the rows from {first} to {last} are not of this robot, or have another unit or sign: the nominal model leaves {stated:.3g} of them, "
    "and {left:.3g} of the others",
    "Put these rows into a file of their own (exclude: {first}-{last}), and read each file by itself.",
)
TURNS = declare(
    "rows-of-two-robots",
    "the rows are of two robots, or of two instruments, in turn: alone, every other row leaves {left:.3g}, all rows together {stated:.3g}",
    "Put every other row into a file of its own.",
)


@record
class _File:
    """The readings of one file, their frames as one trial, what an arm's making leaves (m), and what is left as stated (m)."""

    obs: Observations
    data: DataSet
    making: float
    stated: float

    def part(self, rows: Ints, shifts: Sequence[int] = (0,)) -> list[DataSet]:
        """Some rows, each with the joint values that stand `shift` rows above its own."""
        rolled = (np.roll(self.obs.configuration, shift) for shift in shifts)
        return [DataSet(self.data.configurations, (replace(self.obs, configuration=c).take(rows),)) for c in rolled]

    def span(self, at: Ints) -> dict[str, str | int]:
        """The file, and the numbers of the first and the last of some rows in it."""
        first, last = (int(v) if self.obs.rows is None else int(self.obs.rows[v]) for v in (at[0], at[-1]))
        return {"file": self.obs.source, "first": first, "last": last}


@check("parts", When.READ, order=25, machines=Machines.JOINTED, given=Given.ACCEPTED, needs=("data", "changes"))
def parts_differ(context: ReadContext[Mechanism]) -> Iterator[Finding]:
    """Rows of one file that do not belong to the others."""
    for obs in context.need_data.observations:
        file = _open(context.model, context.need_data, obs)
        found = None if file is None else _compare(context.model, file)
        if found is not None:
            yield found
            return


def _open(chain: Mechanism, data: DataSet, obs: Observations) -> _File | None:
    """A file of which more rows than outliers are far from the others; None for any other."""
    if not usable(obs) or len(obs) < limits.PART_ROWS:
        return None
    one = DataSet(data.configurations, (obs,))
    some = np.unique(np.linspace(0, len(obs) - 1, 2 * MOST).astype(np.int64))
    seen = finite_sights(chain, DataSet(data.configurations, (obs.take(some),)))
    if seen is None or seen.places < limits.HYPOTHESIS_PLACES:
        return None
    with np.errstate(all="ignore"):
        making = limits.MAKING_LEAVES * reach_of(chain, seen)
        left = transfer(chain, seen, seen)[0]
    far = np.mean(left > making) > limits.PART_SHARE
    return _File(obs, one, making, float(np.sqrt(np.mean(left**2)))) if far else None


def _compare(chain: Mechanism, file: _File) -> Finding | None:
    """What both ends of a file say, or every other row."""
    count = len(file.obs)
    if (found := _find_turns(chain, file)) is not None:
        return found
    many, cut = min(max(count // 4, limits.PART_LEAST), MOST), max(SHIFTS)  # where a shift has no partner
    ends = np.arange(cut, cut + many), np.arange(count - many - cut, count - cut)
    left = [_left(chain, file.part(rows)) for rows in ends]
    good = [v is not None and v[0] <= file.making for v in left]
    if good[0] == good[1]:
        return None
    fitted, rest = ends if good[0] else ends[::-1]
    with np.errstate(all="ignore"):
        errors = transfer(chain, _sights(chain, file.part(fitted)), _sights(chain, file.part(np.arange(count), SHIFTS)))
    capped = np.minimum(errors, limits.PART_OFF * file.making)
    seams = [_seam(capped[0], other, good[0]) for other in capped[1:]]
    best = int(np.argmin([cost for _, cost in seams]))
    off, shift = seams[best][0], SHIFTS[1 + best]
    there, stated = float(np.median(errors[1 + best, off])), float(np.median(errors[0, off]))
    if there <= limits.PART_NEAR * file.making and there * limits.EXPLAINED_CLEARLY <= stated:
        where, way = ("below", "down") if shift > 0 else ("above", "up")
        words = {"shift": f"{abs(shift)} row{'s' if abs(shift) > 1 else ''}", "where": where, "way": way}
        return refuse(ROWS_OFF, **file.span(off), **words, stated=Quantity(stated), left=Quantity(there))
    # An arm whose zeros are lost may fit one end by chance, and with other zeros the other.
    with np.errstate(all="ignore"):
        free = fit_trials(chain, _sights(chain, file.part(rest)), SoftPrior.of_chain(chain, LOST), rounds=20).left[0]
    off = _seam(capped[0], limits.PART_OFF * file.making - capped[0], good[0])[0]
    stated, kept = float(np.median(errors[0, off])), float(np.median(np.delete(errors[0], off)))
    # A few gross rows among right ones are no other robot.
    if len(off) < limits.PART_LEAST or not limits.EXPLAINED_CLEARLY * file.making < min(free, there, stated):
        return None
    return refuse(OTHER_ROBOT, **file.span(off), stated=Quantity(stated), left=Quantity(kept))


def _seam(stated: Array, other: Array, ahead: bool) -> tuple[Ints, float]:
    """The rows behind a seam (before it where those ahead are wrong) that are not as stated, and the error of all (m)."""
    gain = np.concatenate([[0.0], np.cumsum(stated - other)])
    # The rows ahead as stated and those behind by the other reading, or the other way round.
    cost = gain + other.sum() if ahead else stated.sum() - gain
    inner = slice(1, -1)
    at = 1 + int(np.argmin(cost[inner]))
    return (np.arange(at, len(stated)) if ahead else np.arange(at)), float(cost[at])


def _sights(chain: Mechanism, trials: Sequence[DataSet]) -> Sights:
    made = sights(chain, trials)
    assert made is not None
    return made


def _left(chain: Mechanism, trials: Sequence[DataSet]) -> Array | None:
    """What each trial leaves (m); None where the joints stood at too few places."""
    seen = _sights(chain, trials)
    if (
        seen.places < limits.HYPOTHESIS_PLACES
        or not np.isfinite(seen.joints).all()
        or not np.isfinite(seen.place).all()
    ):
        return None
    with np.errstate(all="ignore"):
        return fit_trials(chain, seen, SoftPrior.of_chain(chain, SOFT)).left


def _find_turns(chain: Mechanism, file: _File) -> Finding | None:
    """Whether every other row alone is of one robot, wherever its instrument stands: of a place that is stated, half of the rows are."""
    frame = file.obs.frame
    free = None if frame is None else replace(frame, free=(True,) * 6)
    file = replace(file, obs=replace(file.obs, frame=free))
    count = 2 * min(len(file.obs) // 2, MOST)
    together = _left(chain, file.part(np.arange(count)))
    if together is None or together[0] <= file.making:
        return None  # gross rows, and all others are of one
    left = [_left(chain, file.part(np.arange(start, count, 2))) for start in (0, 1)]
    if any(v is None or v[0] > file.making for v in left):
        return None
    worst = max(float(v[0]) for v in left if v is not None)
    return refuse(TURNS, file=file.obs.source, stated=Quantity(file.stated), left=Quantity(worst))
