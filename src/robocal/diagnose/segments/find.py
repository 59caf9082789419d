"""Change points: a target or an instrument that moved while a file was measured.

What a robust fit of everything free leaves is searched for runs of rows that a frame standing elsewhere would explain, the
model's own answer allowed for (a generalised likelihood ratio, see `segment_model`): all pairs of a coarse grid, the
best sharpened row by row and taken into the model, then the next (circular binary segmentation, Olshen et al. 2004).
Half a file 5 mm off is no outlier and no noise. But warmth is no step either, nor a pose that the model predicts
badly. So a segment is named only where it is

    sure       the gain, over the spread of serially correlated residuals (Newey and West 1987), leaves one chance in a million
               after all that was tried
    large      what it explains is several times what noise and model leave per axis
    abrupt     a step explains it better than any ramp
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record, replace
from robocal._types import Array, Bools
from robocal.diagnose import limits
from robocal.diagnose.segments.candidate_rows import runs
from robocal.diagnose.segments.posed import ZERO, ZEROS
from robocal.diagnose.segments.robust_model import SegmentFit, SegmentModel, spread
from robocal.diagnose.segments.row_sequence import Candidate, RowSequence
from robocal.diagnose.serial import correlation_factor
from robocal.measure.data import DataSet
from robocal.measure.machine import Model

__all__ = ["Segment", "find_segments", "motion_size"]

DEGREES = 3  # grid: polynomials along the file that several steps are compared with
SWEEPS = 3  # grid: rounds in which the ends of several segments are looked for beside one another


@record
class Segment:
    """Rows of a file that were measured as if `cause` had moved: `first` and `last` number the observations of the group,
    `rows` are the same ends as the file numbers them."""

    source: str
    group: str
    first: int
    last: int
    rows: tuple[int, int]
    without: tuple[int, int]  # the same with rows beside them that were held out: what to do without
    cause: str  # target, instrument, zero, or zeros
    name: str  # of the target (or all targets) where there are several, else ""
    shift: float | None  # m
    turn: float | None  # rad
    strength: float  # what it explains per axis, over what is left
    p_value: float
    count: int  # rows that are off
    end: int | None  # the row from which on it is over, as the file numbers it; None at the end of the file
    rival: Segment | None = None  # the same rows by a cause that explains as much


def find_segments(
    model: Model, data: DataSet, start: Mapping[str, float], weights: Array | None = None
) -> tuple[Segment, ...]:
    """The segments of every file, the strongest first; `start` holds the parameters of a fit, `weights` (1, U) which
    configurations count."""
    found, info = runs(model, data, start, weights)
    long = [r for r in found if len(r.residual) >= 2 * limits.SEGMENT_ROWS]
    if not long:
        return ()
    state = SegmentModel.of(found, info)
    ends = [(r, c, e) for r in long for c in r.candidates if c.cause == ZERO for e in r.files(c)]
    files = [(r, c, *e) for r, c, e in ends if e[1] - e[0] >= limits.SEGMENT_ROWS]
    tried = sum(len(r.candidates) * r.count**2 / 2 for r in long)
    out: list[Segment] = []
    while len(out) < limits.SEGMENT_COUNT and (best := _reset(state, files)):
        after = state.with_segments(best)
        told = _assess_segment(state, best, after, len(files), True)
        if told is None:
            break
        out.append(told)
        state = after
    out += _find_together(state, long, limits.SEGMENT_COUNT - len(out), tried)
    return tuple(sorted(out, key=lambda s: -s.strength))


def _find_together(state: SegmentModel, long: list[RowSequence], most: int, tried: float) -> list[Segment]:
    """Segments that are sure, large and abrupt beside one another: each is serial correlation to the others.
    So all are taken in, their ends looked for again, and those that chance may have made beside the rest given up one by one."""
    some: list[SegmentFit] = []
    after, before_each = state, []
    while len(some) < most and (found := _best(after, long)):
        best, model = found
        before_each.append(after)
        some.append(_widen(after, best, some))
        after = model if some[-1] is best else after.with_segments(some[-1])
    if _are_small(before_each, some, after):
        return []
    found_at, others = [f.place for f in some], _Others(state)
    for _ in range(SWEEPS if len(some) > 1 else 0):
        before = [f.place for f in some]
        for i in range(len(some)):
            if others.known(some, i):
                continue  # what stands beside it stays where it was
            beside = others.of(some, i)
            one = _widen(beside, some[i], some)
            again = beside.segment(one.run, one.candidate)
            some[i] = one if again is None else replace(again, rival=one.rival)
        if before == [f.place for f in some]:
            break
    if found_at != [f.place for f in some]:
        after = state.with_segments(*some)
    while some:
        # What was fitted without one of them is the model of the others, as long as all stay where they are.
        each = [others.of(some, i) for i in range(len(some))]
        some = [w.refit(one) for w, one in zip(each, some, strict=True)]
        told = [_assess_segment(w, one, after, tried, False) for w, one in zip(each, some, strict=True)]
        unsure = [i for i, s in enumerate(told) if s is None]
        if not unsure:
            return [] if _smooth(state, some, after) else [s for s in told if s is not None]
        last = min(unsure, key=lambda i: each[i].evidence(some[i]) - some[i].cost)
        del some[last]
        after, others = each[last], _Others(state)
    return []


def _are_small(before_each: list[SegmentModel], some: list[SegmentFit], after: SegmentModel) -> bool:
    """Whether segments are not large all together, each on top of those before it: their squares add up, so none will be beside the others.
    No bound holds this strictly; tests hold it against the search without it."""
    return sum(_strength(w, one, after)[1] ** 2 for w, one in zip(before_each, some, strict=True)) < 1


class _Others:
    """The models with all segments but one, each made once for where the others are."""

    def __init__(self, state: SegmentModel) -> None:
        self.state = state
        self.made: dict[int, tuple[list[tuple[Candidate, int, int]], SegmentModel]] = {}

    def known(self, some: list[SegmentFit], i: int) -> bool:
        """Whether the others of the i-th are where they were when it was last asked."""
        return i in self.made and self.made[i][0] == [f.place for f in (*some[:i], *some[i + 1 :])]

    def of(self, some: list[SegmentFit], i: int) -> SegmentModel:
        """The model with the others of the i-th."""
        if not self.known(some, i):
            rest = (*some[:i], *some[i + 1 :])
            self.made[i] = [f.place for f in rest], self.state.with_segments(*rest)
        return self.made[i][1]


def _smooth(state: SegmentModel, some: list[SegmentFit], after: SegmentModel) -> bool:
    """Whether slow changes of the same leave about as little as several steps, `after`: warmth is no row of steps."""
    if len(some) < 2:
        return False
    slow = []
    for run, c in dict.fromkeys((f.run, f.candidate) for f in some):
        time = np.zeros(len(c.column))
        time[c.rows] = np.linspace(-1, 1, len(c.rows))
        degrees = range(1, max(len(some), DEGREES) + 1)
        slow += [(run, c.column * scipy.special.eval_legendre(n, time)[:, None, None]) for n in degrees]
    left = [sum(m.misfit(run) for run in dict.fromkeys(f.run for f in some)) for m in (state.with_columns(slow), after)]
    return left[0] < left[1] + limits.SEGMENT_ALIKE * len(some)


def _widen(state: SegmentModel, best: SegmentFit, some: list[SegmentFit]) -> SegmentFit:
    """One zero that changed in a file in which all of them did at another row: all of them, for that happens at each power-up."""
    alike = (f.candidate for f in some if f.candidate.cause == ZEROS and f.run is best.run)
    wide = next(alike, None) if best.candidate.cause == ZERO else None
    return best if wide is None else state.segment(best.run, wide) or best


def _best(state: SegmentModel, among: list[RowSequence]) -> tuple[SegmentFit, SegmentModel] | None:
    """The segment that explains most, and the model with it. Its cause is the one that leaves least, once it is in the model."""
    out = [f for run in among for c in run.candidates if (f := state.segment(run, c)) is not None]
    # More columns explain more by chance.
    told = [state.evidence(f) for f in out]
    most = max(range(len(out)), key=lambda i: told[i] - out[i].cost, default=None)
    if most is None or not (out[most].gain > 0 and state.chance(out[most], told[most]) <= limits.SEGMENT_CHANCE):
        return None
    first = out[most]
    rivals = [f for f in out if f.run is first.run and f.gain > limits.SEGMENT_RIVAL * first.gain]
    left, cost = np.zeros(len(rivals)), np.zeros(len(rivals))
    for i, f in enumerate(rivals):
        model = state.with_segments(f)
        left[i] = model.misfit(f.run)
        cost[i] = left[i] + f.cost
        if i == 0 or cost[i] < cost[:i].min():
            after = model
    order = np.argsort(cost, kind="stable").tolist()
    best: SegmentFit = rivals[order[0]]
    # What more columns cost speaks for the simpler cause, not against the other one: it may be the true one all the same.
    more = np.minimum(left - left[order[0]], cost - cost[order[0]])
    kind = best.candidate.cause.removesuffix("s")  # one zero is among all zeros
    others = [
        i for i in order if more[i] < limits.SEGMENT_ALIKE and rivals[i].candidate.cause.removesuffix("s") != kind
    ]
    return replace(best, rival=rivals[others[0]] if others else None), after


def _reset(state: SegmentModel, files: list[tuple[RowSequence, Candidate, int, int]]) -> SegmentFit | None:
    """A zero that is another one in a whole file, as after sensors were switched on again: with its rows given it need only be sure."""
    best = max((state.whole_file(*one) for one in files), key=lambda f: f.gain, default=None)
    sure = best is not None and scipy.special.chdtrc(1, best.gain) * len(files) <= limits.SEGMENT_CHANCE
    return best if sure else None


def _assess_segment(
    state: SegmentModel, best: SegmentFit, after: SegmentModel, tried: float, whole: bool
) -> Segment | None:
    """The segment for people, or None where it is not large, sure and abrupt; `after` has it in the model. A whole file that is off
    need only be sure."""
    i, c = state.runs.index(best.run), best.candidate
    left, unit = after.left[i], after.unit[i]
    looked, mine = _rows_of(best)
    strength, large = _strength(state, best, after)
    moved = motion_size(best, mine)
    sees = large >= 1 and _together(best, left, unit, mine) >= limits.SEGMENT_MAJORITY
    if not ((sees or whole) and any(v > limits.SEGMENT_SMALL.get(u, 0.0) for u, v in moved.items())):
        return None
    share, label = best.run.share[looked], best.run.label[looked]
    score = share[:, None] * np.einsum("kdq,kd->kq", c.column[looked] / unit[:, None], left[looked])
    # Visits of one place that follow one another have weights for what they share: of their sums is asked what follows.
    inflation = correlation_factor(np.add.reduceat(score, np.flatnonzero(np.append(True, np.diff(label) != 0))))
    q = c.column.shape[2]
    dof = max((float(share.sum()) * left.shape[1] - q) / inflation - after.used, 1.0)
    known = state.in_units_of(after)
    gain = known.refit(best).gain
    chance = float(scipy.special.fdtrc(q, dof, gain / (inflation * q))) * tried
    if chance > limits.SEGMENT_CHANCE or not (whole or _abrupt(known, best)):
        return None
    told = [_tell(f, strength, chance, int(mine.sum())) for f in (best, best.rival) if f is not None]
    return replace(told[0], rival=told[1] if best.rival is not None else None)


def _rows_of(best: SegmentFit) -> tuple[Bools, Bools]:
    """The rows that would have seen it, and those of them on the segment."""
    looked = np.zeros(len(best.run.residual), dtype=bool)
    looked[best.candidate.rows] = True
    mine = looked.copy()
    mine[: best.a] = mine[best.b :] = False
    return looked, mine


def _strength(state: SegmentModel, best: SegmentFit, after: SegmentModel) -> tuple[float, float]:
    """What a segment explains per axis of its rows, over what is left, and how large that is of what a large one is at least."""
    i, c = state.runs.index(best.run), best.candidate
    left, unit = after.left[i], after.unit[i]
    looked, mine = _rows_of(best)
    effect = best.column @ best.unexplained
    strength = 0.0
    for first, stop, _ in best.run.parts:
        noise = unit[first] * max(1.0, spread(left[mine, first:stop]))
        strength = max(strength, _size(best, effect[mine, first:stop], mine) / noise)
    # The share that the model does not answer, over the fewer rows: a step in most rows is one in the others.
    own = float(np.sum(state.weight[i][:, None] * (effect / state.unit[i]) ** 2))
    few = min(mine.sum(), (looked & ~mine).sum()) / mine.sum()
    seen = strength * math.sqrt(best.gain / max(own, 1e-300) / few)
    least = limits.SEGMENT_ZERO_SIZE if c.cause in (ZERO, ZEROS) else limits.SEGMENT_SIZE
    large = min(strength / least, seen / limits.SEGMENT_SEEN)
    if c.plain is not None:  # where poses are projected out, every number shows little of a step
        large = max(large, math.sqrt(best.gain / (limits.SEGMENT_SHARE * best.run.count * left.shape[1])))
    return strength, large


def _tell(best: SegmentFit, strength: float, chance: float, count: int) -> Segment:
    """A segment as its file numbers the rows."""
    c, run, last = best.candidate, best.run, best.b - 1
    _, inside = _rows_of(best)
    moved = motion_size(best, inside)
    source, rows = run.place(c, best.a, last)
    _, without = run.place(c, *run.beside(c, best.a, last))
    size = moved.get("m"), moved.get("rad")
    beyond = c.rows[best.ends[1] :][:1].tolist()
    over = [row for i in beyond for where, (row, _) in [run.place(c, i, i)] if where == source]
    end = over[0] if over else None
    return Segment(
        source, run.obs.label, best.a, last, rows, without, c.cause, c.name, *size, strength, chance, count, end
    )


def _together(best: SegmentFit, left: Array, unit: Array, mine: Bools) -> float:
    """The share of the rows that are nearer to the model with the step than without: gross rows do not all move alike."""
    step = (best.column @ best.step / unit)[mine]
    here, before, beyond = (((left[mine] + by * step) ** 2).sum(axis=1) for by in (0, 1, -1))
    return float(np.mean(here < np.minimum(before, beyond)))


def _size(best: SegmentFit, effect: Array, mine: Bools) -> float:
    """What a segment does to a reading that sees it, rms in its standard deviations."""
    plain = best.candidate.plain
    if plain is None:
        return float(np.sqrt(np.mean(effect**2)))
    felt = (plain.column != 0).any(axis=2) & mine[:, None]
    return float(np.sqrt(np.mean((plain.column @ best.unexplained)[felt] ** 2)))


def motion_size(best: SegmentFit, mine: Bools) -> dict[str, float]:
    """How far what was measured moved, rms over the rows, in every unit in which it did, the farthest."""
    plain = best.candidate.plain
    effect, sigma, parts = best.column @ best.step, best.run.sigma, best.run.parts
    if plain is not None:
        effect, parts = (plain.column @ best.step) * mine[:, None], plain.parts
        sigma = np.where(np.isfinite(plain.sigma), plain.sigma, 0.0)
    far = (effect * sigma)[(effect != 0).any(axis=1)]
    out: dict[str, float] = {}
    each = np.mean if best.candidate.cause == ZEROS else np.sum  # of one zero, or of a place's coordinates
    for a, b, u in parts:
        out[u] = max(out.get(u, 0.0), float(np.sqrt(np.mean(each(far[:, a:b] ** 2, axis=1)))))
    # A camera moves pixels: beside cables, lengths in m show nothing of it.
    return {u: v for u, v in out.items() if v > 0.0}


def _abrupt(state: SegmentModel, best: SegmentFit) -> bool:
    """Whether a step explains at least as much as any ramp about the same place."""
    rows = best.candidate.rows
    k = len(rows)
    first, last = int(np.searchsorted(rows, best.a)), int(np.searchsorted(rows, best.b))
    gain = state.shared(best.run, best.candidate)
    step = gain(_profile(k, first, last, 0))
    width = 2 * limits.SEGMENT_ROWS
    while width <= 2 * k:
        if gain(_profile(k, first, last, width)) > step:
            return False
        width *= 2
    return True


def _profile(k: int, first: int, last: int, width: int) -> Array:
    """1 on the segment, 0 elsewhere, with ramps of `width` rows about the ends that are not the file's."""
    at = np.arange(k) + 0.5
    rise = np.ones(k) if first == 0 else np.clip((at - first) / max(width, 1e-9) + 0.5, 0, 1)
    fall = np.ones(k) if last == k else np.clip((last - at) / max(width, 1e-9) + 0.5, 0, 1)
    return np.asarray(np.minimum(rise, fall))
