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
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from robocal import _scipy as scipy
from robocal._record import dataclass
from robocal._types import Array
from robocal.diagnose import limits
from robocal.diagnose.segments.candidate_rows import runs
from robocal.diagnose.segments.posed import ZERO, ZEROS
from robocal.diagnose.segments.robust_model import SegmentFit, SegmentModel, spread
from robocal.diagnose.segments.row_sequence import Candidate, RowSequence
from robocal.diagnose.serial import correlation_factor
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.remarks.code import Code
from robocal.remarks.english import declare
from robocal.remarks.remark import Number, Quantity, Remark

__all__ = ["Segment", "find_segments", "segment_numbers", "segment_remarks"]

# What a data file of its own says, so that what moved has a place of its own there.
LINES = {
    "target": "targets: {moved: {}}",
    "instrument": "frame: {name: moved}",
    "target or instrument": "frame: {name: moved}, or targets: {moved: {}}",
}
MOVED = ("target", "instrument")
EITHER = declare(
    "segment-of-either",
    "{file}: from row {first} to row {last} everything is off as if the instrument had moved[ by {shift:.3g}]; or {other}: from row "
    "{begin} to row {end} as if {sensors} had been reset[ by {by:.3g}] ({count} rows, {strength:.1f} times the residual elsewhere)",
    "If the instrument moved, read these rows of {file} by a second data file with `frame: {{name: moved}}`. If the sensors were reset, "
    "those of {other} by one with `zeros: NAME`. Or do without them (--exclude {first}-{last}).",
)


@dataclass(frozen=True)
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
    state = SegmentModel(found, [r.jacobian for r in found], info)
    ends = [(r, c, e) for r in long for c in r.candidates if c.cause == ZERO for e in r.files(c)]
    files = [(r, c, *e) for r, c, e in ends if e[1] - e[0] >= limits.SEGMENT_ROWS]
    tried = sum(len(r.candidates) * r.count**2 / 2 for r in long)
    out: list[Segment] = []
    for whole, chances in ((True, len(files)), (False, tried)):
        while len(out) < limits.SEGMENT_COUNT and (best := _reset(state, files) if whole else _best(state, long)):
            after = state.with_segment(best)
            told = _assess_segment(state, best, after, chances, whole)
            if told is None:
                break
            out.append(told)
            state = after
    return tuple(sorted(out, key=lambda s: -s.strength))


def segment_numbers(s: Segment) -> dict[str, Number]:
    """The numbers that a remark has of a segment."""
    said: dict[str, Number] = {"file": s.source or s.group, "first": s.rows[0], "last": s.rows[1], "count": s.count}
    said["shift"] = None if s.shift is None else Quantity(s.shift)
    said["turn"] = None if s.turn is None else Quantity(s.turn, "rad")
    said["strength"] = s.strength
    return said


def segment_remarks(found: tuple[Segment, ...]) -> tuple[Remark, ...]:
    """One remark for every segment."""
    out = []
    for s in found:
        said = segment_numbers(s)
        if s.rival is not None and ZERO in (s.cause.removesuffix("s"), s.rival.cause.removesuffix("s")):
            out.append(_either(s, s.rival))
        elif s.rival is not None:
            moved = " or ".join(c for c in MOVED if c in (s.cause, s.rival.cause))
            out.append(Remark.of(Code.SEGMENT, **said, moved=moved, line=LINES[moved]))
        elif s.cause == ZERO:
            of_zero = {k: v for k, v in said.items() if k != "turn"}
            begin, end = s.without
            out.append(Remark.of(Code.SEGMENT_OF_ZERO, **of_zero, zero=s.name, begin=begin, end=end))
        elif s.cause == ZEROS:
            of_zeros = {k: v for k, v in said.items() if k != "turn"}
            out.append(Remark.of(Code.SEGMENT_OF_ZEROS, **of_zeros))
        elif s.name and s.cause == "target":
            out.append(Remark.of(Code.SEGMENT_OF_TARGET, **said, target=s.name))
        else:
            out.append(Remark.of(Code.SEGMENT, **said, moved=s.cause, line=LINES[s.cause]))
    return tuple(out)


def _either(*both: Segment) -> Remark:
    """An instrument that moved, or zeros that were set anew, each with its file and rows."""
    zeros, moved = sorted(both, key=lambda s: not s.cause.startswith(ZERO))
    said = {k: v for k, v in segment_numbers(moved).items() if k != "turn"} | {
        "strength": max(s.strength for s in both)
    }
    sensors = f"zero {zeros.name}" if zeros.cause == ZERO else "several zeros"
    anew = segment_numbers(zeros)
    second = {
        "other": anew["file"],
        "begin": anew["first"],
        "end": anew["last"],
        "by": anew["shift"],
        "sensors": sensors,
    }
    return Remark.of(EITHER, **said, **second)


def _best(state: SegmentModel, among: list[RowSequence]) -> SegmentFit | None:
    """The segment that explains most. Its cause is the one that leaves least, once it is in the model."""
    out = [f for run in among for c in run.candidates if (f := state.segment(run, c)) is not None]
    # More columns explain more by chance.
    first = max(out, key=lambda f: state.evidence(f) - f.cost, default=None)
    if first is None or state.chance(first) > limits.SEGMENT_CHANCE:
        return None
    rivals = [f for f in out if f.run is first.run and f.gain > limits.SEGMENT_RIVAL * first.gain]
    left = np.array([state.with_segment(f).misfit(f.run) for f in rivals])
    cost = left + [f.cost for f in rivals]
    order = np.argsort(cost, kind="stable").tolist()
    best: SegmentFit = rivals[order[0]]
    # What more columns cost speaks for the simpler cause, not against the other one: it may be the true one all the same.
    more = np.minimum(left - left[order[0]], cost - cost[order[0]])
    kind = best.candidate.cause.removesuffix("s")  # one zero is among all zeros
    others = [
        i for i in order if more[i] < limits.SEGMENT_ALIKE and rivals[i].candidate.cause.removesuffix("s") != kind
    ]
    return replace(best, rival=rivals[others[0]] if others else None)


def _reset(state: SegmentModel, files: list[tuple[RowSequence, Candidate, int, int]]) -> SegmentFit | None:
    """A zero that is another one in a whole file, as after sensors were switched on again: with its rows given it need only be sure."""
    best = max((state.whole_file(*one) for one in files), key=lambda f: f.gain, default=None)
    sure = best is not None and scipy.special.chdtrc(1, best.gain) * len(files) <= limits.SEGMENT_CHANCE
    return best if sure else None


def _assess_segment(
    state: SegmentModel, best: SegmentFit, after: SegmentModel, tried: float, whole: bool
) -> Segment | None:
    """The segment for people, or None where it is not sure, large and abrupt; `after` has it in the model. A whole file that is
    off need only be sure."""
    i, c = state.runs.index(best.run), best.candidate
    left, unit = after.left[i], after.unit[i]
    looked = np.zeros(len(left), dtype=bool)
    looked[c.rows] = True
    mine = looked.copy()
    mine[: best.a] = mine[best.b :] = False
    effect = best.column @ best.unexplained
    strength = 0.0
    for first, stop, _ in best.run.parts:
        noise = unit[first] * max(1.0, spread(left[mine, first:stop]))
        strength = max(strength, _size(best, effect[mine, first:stop], mine) / noise)
    # The share that the model does not answer, over the fewer rows: a step in most rows is one in the others.
    own = float(np.sum(state.weight[i][:, None] * (effect / state.unit[i]) ** 2))
    few = min(mine.sum(), (looked & ~mine).sum()) / mine.sum()
    moved = _motion_size(best, mine)
    seen = strength * math.sqrt(best.gain / max(own, 1e-300) / few)
    least = limits.SEGMENT_ZERO_SIZE if c.cause in (ZERO, ZEROS) else limits.SEGMENT_SIZE
    large = strength >= least and seen >= limits.SEGMENT_SEEN
    if c.plain is not None:  # where poses are projected out, every number shows little of a step
        large |= best.gain >= limits.SEGMENT_SHARE * best.run.count * left.shape[1]
    if not whole and (not large or _together(best, left, unit, mine) < limits.SEGMENT_MAJORITY):
        return None
    if all(v <= limits.SEGMENT_SMALL.get(u, 0.0) for u, v in moved.items()):
        return None
    share, label = best.run.share[looked], best.run.label[looked]
    score = share[:, None] * np.einsum("kdq,kd->kq", c.column[looked] / unit[:, None], left[looked])
    # Visits of one place that follow one another have weights for what they share: of their sums is asked what follows.
    inflation = correlation_factor(np.add.reduceat(score, np.flatnonzero(np.append(True, np.diff(label) != 0))))
    q = c.column.shape[2]
    dof = max((float(share.sum()) * left.shape[1] - q) / inflation - after.used, 1.0)
    gain = best.gain * max(1.0, float(np.min(state.unit[i] / unit)) ** 2)
    chance = float(scipy.special.fdtrc(q, dof, gain / (inflation * q))) * tried
    if chance > limits.SEGMENT_CHANCE or not (whole or _abrupt(state, best)):
        return None
    found = _tell(best, float(strength), chance, int(mine.sum()))
    return (
        found
        if best.rival is None
        else replace(found, rival=_tell(best.rival, float(strength), chance, int(mine.sum())))
    )


def _tell(best: SegmentFit, strength: float, chance: float, count: int) -> Segment:
    """A segment as its file numbers the rows."""
    c, run, last = best.candidate, best.run, best.b - 1
    inside = np.zeros(len(run.residual), dtype=bool)
    inside[c.rows] = True
    inside[: best.a] = inside[best.b :] = False
    moved = _motion_size(best, inside)
    source, rows = run.place(c, best.a, last)
    _, without = run.place(c, *run.beside(c, best.a, last))
    size = moved.get("m"), moved.get("rad")
    return Segment(source, run.obs.label, best.a, last, rows, without, c.cause, c.name, *size, strength, chance, count)


def _together(best: SegmentFit, left: Array, unit: Array, mine: NDArray[np.bool_]) -> float:
    """The share of the rows that are nearer to the model with the step than without: gross rows do not all move alike."""
    step = (best.column @ best.step / unit)[mine]
    here, before, beyond = (((left[mine] + by * step) ** 2).sum(axis=1) for by in (0, 1, -1))
    return float(np.mean(here < np.minimum(before, beyond)))


def _size(best: SegmentFit, effect: Array, mine: NDArray[np.bool_]) -> float:
    """What a segment does to a reading that sees it, rms in its standard deviations."""
    plain = best.candidate.plain
    if plain is None:
        return float(np.sqrt(np.mean(effect**2)))
    felt = (plain.column != 0).any(axis=2) & mine[:, None]
    return float(np.sqrt(np.mean((plain.column @ best.unexplained)[felt] ** 2)))


def _motion_size(best: SegmentFit, mine: NDArray[np.bool_]) -> dict[str, float]:
    """How far what was measured moved, rms over the rows, in every unit of its kinds, the farthest."""
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
    return out


def _abrupt(state: SegmentModel, best: SegmentFit) -> bool:
    """Whether a step explains at least as much as any ramp about the same place."""
    rows = best.candidate.rows
    k = len(rows)
    first, last = int(np.searchsorted(rows, best.a)), int(np.searchsorted(rows, best.b))
    step = state.shared(best.run, best.candidate, _profile(k, first, last, 0))
    width = 2 * limits.SEGMENT_ROWS
    while width <= 2 * k:
        if state.shared(best.run, best.candidate, _profile(k, first, last, width)) > step:
            return False
        width *= 2
    return True


def _profile(k: int, first: int, last: int, width: int) -> Array:
    """1 on the segment, 0 elsewhere, with ramps of `width` rows about the ends that are not the file's."""
    at = np.arange(k) + 0.5
    rise = np.ones(k) if first == 0 else np.clip((at - first) / max(width, 1e-9) + 0.5, 0, 1)
    fall = np.ones(k) if last == k else np.clip((last - at) / max(width, 1e-9) + 0.5, 0, 1)
    return np.asarray(np.minimum(rise, fall))
