"""Units that people mix up: what does not fit as it is stated is tried in other units before anything is believed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from robocal._types import Array
from robocal.diagnose.check_registry import Finding, Given, Level, Machines, When, check, of_remarks, refuse
from robocal.diagnose.hypotheses.one_change import mistake
from robocal.diagnose.hypotheses.reading import OtherUnit, ReadContext
from robocal.diagnose.limits import UNIT_BETTER, UNIT_GAIN, UNIT_MISFIT, UNIT_SPARE
from robocal.estimate.problem import Problem
from robocal.fit.baseline import baseline, frame_names
from robocal.fit.frames_alike import fix_frames
from robocal.fit.misfit import errors
from robocal.fit.repeats import NEAR, joined
from robocal.measure.base import kind_of
from robocal.measure.data import DataSet
from robocal.measure.machine import Mechanism, Model
from robocal.measure.reach import reach
from robocal.progress import tell
from robocal.remarks.english import declare

__all__ = ["WRONG_UNIT", "misfit", "units"]

# grid: configurations, and rows of one target at one of them, that are enough to tell units apart
MANY, ROWS = 300, 16
WRONG_UNIT = declare(
    "wrong-unit",
    "the {part} values are probably in {alternative}: {why}, and the misfit falls {times:.3g} times{likewise}",
    "State that unit.",
)


@check("units", When.READ, order=20, machines=Machines.JOINTED, given=Given.ACCEPTED, needs=("data",))
def units(context: ReadContext[Mechanism]) -> Iterator[Finding]:
    """Every suspected unit: refused where other units lower the misfit tenfold and then fit, else a doubt."""
    doubts = context.suspicions[:6]
    sample = _sample(context.need_data)
    as_read = misfit(context.model, sample)
    bad = not as_read <= UNIT_MISFIT and not np.isnan(as_read)
    if not doubts and not bad:
        return
    tell(context.watch, "read", what="trying other units")
    best = as_read
    chosen: tuple[OtherUnit, ...] = ()
    tried = [some for size in range(1, len(doubts) + 1) for some in combinations(doubts, size)]
    few = _thin(sample)
    for some in dict.fromkeys((*tried, *(_explanations(context.alternatives) if bad else ()))):
        found = misfit(context.model, _restate(few, some))
        # Of two equally good explanations the one with fewer changes stands.
        if np.isfinite(found) and found < UNIT_BETTER * best:
            best, chosen = found, some
    if chosen and few is not sample:
        best = misfit(context.model, _restate(sample, chosen))
    # What leaves much of the misfit is no explanation, whatever it lowers.
    explains = chosen and best * UNIT_GAIN <= as_read and best <= UNIT_MISFIT
    if not explains or _is_one_of_two(context):
        yield from of_remarks([d.remark for d in doubts], Level.DOUBT)
    elif context.forgotten:
        yield from of_remarks(dict.fromkeys(d.remark for d in (*chosen, *doubts)), Level.DOUBT)
    else:
        first = chosen[0]
        likewise = "".join(f"; likewise the {d.part} values of {d.source} in {d.alternative}" for d in chosen[1:])
        names = {"source": first.source, "part": first.part, "stated": first.stated, "alternative": first.alternative}
        times = float(as_read / best if best > 0 else np.inf)
        yield refuse(WRONG_UNIT, **names, why=str(first.reason), times=times, likewise=likewise)


def _is_one_of_two(context: ReadContext[Mechanism]) -> bool:
    """Whether no single change explains the data, a unit neither, but two do: lengths alone may hide what angles tell."""
    found = None if context.changes is None else mistake(context)
    return found is not None and found.explanation is not None and len(found.explanation.changes[0]) > 1


def misfit(chain: Model, data: DataSet) -> float:
    """What the nominal model with fitted frames leaves, relative to the spread of what was measured: the same in every
    unit.

    Where positions are not measured, the spread is that of where the tool was; where nothing is told in lengths, angles
    and pixels are compared with their own spread. nan where there is nothing to compare, or so
    little that frames alone meet it in any unit.
    """
    # What a fit of these data will hold tells nothing here either; only free numbers may be too many for them.
    fitted, fixed = fix_frames(chain, data)
    problem, x = baseline(fitted, data, np.arange(len(data.configurations)))
    free = len(frame_names(chain, problem)) + sum(len(f.parameters) for f in fixed)
    if _count_measured(data, problem) < free + UNIT_SPARE:
        return float("nan")
    left = {unit: errors(problem.residuals(x), unit)[0] for unit in ("m", "rad", "px")}
    unit = next((u for u, v in left.items() if len(v)), "")
    points = [o.value[:, :3] for o in data.observations if o.kind in ("position", "pose")]
    if not points and unit == "m":
        points = _tools(chain, data)
    elif not points:
        points = [o.value for o in data.observations if kind_of(o).parts[0][2] == unit]
    if not unit or not points:
        return float("nan")
    width = points[0].shape[1]
    square = [np.sum((p - p.mean(axis=0)) ** 2, axis=1) for p in points if p.shape[1] == width]
    spread = float(np.sqrt(np.mean(np.concatenate(square))))
    rms = float(np.sqrt(np.mean(left[unit] ** 2)))
    return rms / spread if spread > 0 else float("inf")


def _count_measured(data: DataSet, problem: Problem) -> float:
    """How many numbers were measured, a repeat of a place not counted: it says nothing new of the geometry."""
    used = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *(t.configuration for t in problem.terms)]))
    # As closely as encoders repeat: how near visits of one place are, is said in the unit that is in doubt.
    new = len(np.unique(joined(data.configurations, NEAR)[used])) / max(len(used), 1)
    return new * sum(t.scale.size for t in problem.terms)


def _tools(chain: Model, data: DataSet) -> list[Array]:
    """Where the nominal tool is wherever something was measured, (m, 3) in a list; empty when it is nowhere."""
    q = data.configurations.joints
    if q is None:
        return []
    used = np.unique(np.concatenate([o.configuration for o in data.observations]))
    used = used[np.isfinite(q[used]).all(axis=1)]
    recorded = {k: v[used] for k, v in data.configurations.columns.items()}
    return [reach(chain, q[used], (), recorded)[0][:, :3, 3]] if len(used) else []


def _restate(data: DataSet, others: Sequence[OtherUnit]) -> DataSet:
    """The data in other units."""
    for other in others:
        data = other.apply(data)
    return data


def _thin(data: DataSet) -> DataSet:
    """At most ROWS rows of a target at one configuration, spread over all of them; the same data where none has more."""
    kept = []
    for obs in data.observations:
        view = obs.configuration if obs.target is None else obs.configuration * len(obs.targets) + obs.target
        order = np.argsort(view, kind="stable")
        _, first, count = np.unique(view[order], return_index=True, return_counts=True)
        rank, many = np.arange(len(view)) - np.repeat(first, count), np.repeat(count, count)
        kept.append(order[(many <= ROWS) | (rank * ROWS % many < ROWS)])
    if all(len(rows) == len(o) for rows, o in zip(kept, data.observations, strict=True)):
        return data
    few = (o.take(np.sort(rows)) for o, rows in zip(data.observations, kept, strict=True))
    return DataSet(data.configurations, tuple(few))


def _sample(data: DataSet) -> DataSet:
    """At most MANY configurations: a wrong unit shows in any of them."""
    count = len(data.configurations)
    if count <= MANY:
        return data
    some = data.take(np.unique(np.linspace(0, count - 1, MANY).astype(np.int64)))
    return some if {o.source for o in some.observations} == {o.source for o in data.observations} else data


def _explanations(alternatives: Sequence[OtherUnit]) -> Iterator[tuple[OtherUnit, ...]]:
    """Other units of one file, joints and positions alone or both, and then the same swap in every file."""
    sources = list(dict.fromkeys(a.source for a in alternatives))[:4]
    of = {s: {(a.part, a.stated, a.alternative): a for a in alternatives if a.source == s} for s in sources}
    ways: dict[tuple[tuple[str, str, str], ...], None] = {}
    for mine in of.values():
        joints: list[tuple[tuple[str, str, str], ...]] = [(), *((k,) for k in mine if k[0] == "joints")]
        places: list[tuple[tuple[str, str, str], ...]] = [(), *((k,) for k in mine if k[0] != "joints")]
        # A single change is tried before two at once.
        ways |= dict.fromkeys(sorted((j + p for j in joints for p in places if j + p), key=len))
    for way in ways:
        holders = [s for s in sources if all(k in of[s] for k in way)]
        yield from (tuple(of[s][k] for k in way) for s in holders)
        if len(holders) > 1:
            yield tuple(of[s][k] for s in holders for k in way)
