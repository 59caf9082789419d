"""Readings of a moving machine that belong to another moment than those beside them: clocks that differ, a filter that lags.

    r(q - s v) = r - s c,    c = dr/dq v        of an arm, v the speed of its joints
                             c = L v            of a machine with poses of its own, L the rows' columns of the pose, v its twist

s is a number like a radius that was stated: nought was taken, and the score test of `stated_numbers` asks the residuals r whether they
want another one, for every instrument, and for every sensor of an instrument that has one for each part of the machine (the cables).
Poses of their own are projected out. So of two instruments only the one's lag behind the other is seen.
Rows that were set aside as gross are asked too: of a sensor that lags they are those at speed.
A path that is measured late is late at its held-out rows as well: no gain on unseen rows shows it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Bools, Ints
from robocal.diagnose import limits
from robocal.diagnose.check_registry import Context, Finding, check_fit_twice, doubt, once, refuse
from robocal.diagnose.path_rates import joint_rates, pose_rates, time_order
from robocal.diagnose.serial import correlation_factor
from robocal.diagnose.stated_numbers import Score, score
from robocal.estimate.elimination import beside_blocks
from robocal.estimate.problem import Problem
from robocal.fit.noise import owners
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet
from robocal.measure.machine import Model, freedom_of, joints_of
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity

__all__ = ["follows_path", "time_offset"]

STEP = 1e-6  # rad or m, by which joints move in the difference of residuals
TAKEN = 1e-6  # tolerance: of a column that poses take up whole: rounding


@record
class Lag:
    """A sensor, what the other readings are, what the score says of it, whether times are seconds (else rows), and which share it
    explains of the squares that the stated noise does not leave."""

    sensor: str
    than: str
    score: Score
    timed: bool
    excess: float

    @property
    def wrong(self) -> bool:
        """Whether it explains a good part of the squares, most of it beyond the stated noise; or all that is beyond that noise."""
        share = self.score.share
        most = share > limits.NUMBER_SHARE and self.excess > limits.LATE_SHARE
        return most or (share > limits.LATE_WHOLE_SHARE and self.excess > limits.LATE_WHOLE)


@check_fit_twice(doubt=("time-offset", 230), refuse=("wrong-time", 160))
@once
def time_offset(context: Context[Model]) -> list[Finding]:
    """The sensor whose readings belong most clearly to another moment, by the rates along a path. It is refused where that explains
    a good part of what is left, and most of it beyond the stated noise, or all that is beyond it: held-out rows are late as well."""
    data = context.need_fit.data
    every = tuple(replace(o, used=None) for o in data.observations)
    looks = [data] if all(o.used is None for o in data.observations) else [data, replace(data, observations=every)]
    found = [lag for some in looks if (lag := _find_lag(context, some)) is not None]
    lag = max(found, key=lambda v: (v.wrong, v.score.share), default=None)
    if lag is None:
        return []
    change, unit = abs(lag.score.change), "s" if lag.timed else "rows"
    size, sigma = Quantity(change, unit), Quantity(change / lag.score.t, unit)
    before, after = (size, None) if lag.score.change < 0 else (None, size)
    level, code = (refuse, Code.LATE) if lag.wrong else (doubt, Code.LATE_DOUBTED)
    option = "--groups backlash" if joints_of(context.model) else None
    said = {
        "option": option,
        "before": before,
        "after": after,
        "than": lag.than,
        "sigma": sigma,
        "z": lag.score.t,
        "share": lag.score.share,
    }
    return [level(code, group=lag.sensor, **said)]


def follows_path(context: Context[Model]) -> bool:
    """Whether configurations were taken along a path, so that a delay would show."""
    fit = context.need_fit
    if freedom_of(context.model) is None:
        return joint_rates(fit.data.configurations) is not None
    own = (fit.data.configurations, fit.problem, fit.solution.x)
    return bool(fit.problem.blocks) and pose_rates(*own, context.jacobian) is not None


def _find_lag(context: Context[Model], data: DataSet) -> Lag | None:
    """The clearest lag in these rows, where there is one beyond chance that is of consequence."""
    fit, own = context.need_fit, freedom_of(context.model) is not None
    rates = None if own else joint_rates(data.configurations)
    if not own and rates is None:
        return None
    problem, x = fit.problem, fit.solution.x
    if data is not fit.data:
        problem = build(context.model, data, values=context.values)
        problem = problem.with_weights(fit.problem.weights).with_free(fit.problem.free)
    if (problem.blocks and not own) or (own and not problem.blocks):
        return None  # places that are found beside an arm's own take up whatever its way could say
    lin = context.jacobian if data is fit.data else problem.linearize(x)
    if own:
        rates = pose_rates(data.configurations, problem, x, lin)
        if rates is None:
            return None
        late = np.einsum("nl,nl->n", lin.jl, rates[0][np.maximum(lin.local, 0)]) * (lin.local >= 0)
    else:
        assert rates is not None
        late = _by_joints(context, data, problem, rates[0])
    # Of the others nobody knows how fast they moved: they say nothing of a lag.
    told = (rates[0] != 0).any(axis=1)[lin.configuration]
    sensors, owner = _sensors(context, data, problem)
    columns = np.stack([np.where(np.isin(owner, parts), late, 0.0) for _, _, parts in sensors], axis=1)
    taken, left = (v[told] for v in beside_blocks(replace(lin, j=np.hstack([lin.j, columns, lin.r[:, None]]))))
    n, k = problem.n, len(sensors)
    c = left[:, n : n + k]
    c = np.where(np.linalg.norm(c, axis=0) > TAKEN * np.linalg.norm(columns, axis=0), c, 0.0)
    found = score(left[:, :n], left[:, -1], problem.scales, c, float(taken.sum().round()) + problem.repeated)
    if found is None:
        return None
    # Errors of a model are smooth along a path, and so is a speed: what follows one another is fewer numbers.
    order = time_order(data.configurations)[0]
    each = np.zeros(len(order))
    np.add.at(each, lin.configuration[told], found.addends)
    each = each[order]
    found = replace(found, t=found.t / np.sqrt(correlation_factor(each[:, None])))
    # Of lengths beside thousands of pixels: what it explains of the instrument whose readings it changes most.
    before, after = (np.bincount(lin.group[told], v) for v in found.squares)
    most = float(((before - after) / np.maximum(before, 1e-300)).max())
    whole, found = found.share, replace(found, share=max(found.share, most))
    if found.t < limits.NUMBER_SIGMA or found.share < limits.LATE_DOUBT_SHARE:
        return None
    sensor, than, _ = sensors[found.column]
    square = float(left[:, -1] @ left[:, -1])
    honest = float(_stated_share(context, data, problem)[told].sum()) * (1 - (taken.sum() + n) / len(taken))
    excess = min(whole * square / max(square - honest, 1e-12 * square), 1.0)
    return Lag(sensor, than, found, rates[1], excess)


def _by_joints(context: Context[Model], data: DataSet, problem: Problem, speed: Array) -> Array:
    """What the joints' way in a unit of time does to every whitened row, (N,)."""
    joints, step = data.configurations.joints, STEP / float(np.abs(speed).max())
    assert joints is not None

    def rows_at(moved: float) -> Array:
        there = replace(data, configurations=replace(data.configurations, joints=joints + moved * speed))
        made = build(context.model, there, values=context.values)
        return made.with_weights(problem.weights).with_free(()).linearize(made.start).r

    return np.asarray((rows_at(step) - rows_at(-step)) / (2 * step))


def _sensors(context: Context[Model], data: DataSet, problem: Problem) -> tuple[list[tuple[str, str, Ints]], Ints]:
    """Every sensor with its name, what the others are called, and the numbers of its parts; and of every row of `linearize`, in their
    order, the part that it belongs to."""
    parts: dict[tuple[str, str], int] = {}
    owner = [np.zeros(0, dtype=np.int64)]
    for (number, term), counts in zip(owners(data, problem), _counts(problem), strict=True):
        obs = data.observations[number]
        mine = np.zeros(len(counts), dtype=np.int64)
        of_part = next(((w, names) for w, names in context.model.parts.items() if w in obs.extra), None)
        if of_part is None:
            mine[:] = parts.setdefault((term.group, ""), len(parts))
        else:
            word, names = of_part
            which = obs.extra[word][term.index].astype(np.int64)
            for i in np.unique(which).tolist():
                mine[which == i] = parts.setdefault((term.group, f"{word} {names[i]}"), len(parts))
        owner.append(np.repeat(mine[counts], term.scale.shape[1]))
    groups = list(dict.fromkeys(group for group, _ in parts))
    own = freedom_of(context.model) is not None
    out: list[tuple[str, str, Ints]] = []
    # Of two instruments beside poses that are found, one's lag is the other's lead: the first is named.
    for group in groups[:1] if own and len(groups) == 2 else groups:
        other = f"those of {', '.join(g for g in groups if g != group)}" if own else "their joint values"
        out.append((group, other, np.array([at for (g, _), at in parts.items() if g == group])))
    beside = "those beside them" if own else "their joint values"
    out += [(f"{part} of {group}", beside, np.array([at])) for (group, part), at in parts.items() if part]
    return out, np.concatenate(owner)


def _stated_share(context: Context[Model], data: DataSet, problem: Problem) -> Array:
    """Which share of its variance every row of `linearize` has from the noise that was stated, (N,)."""
    out = [np.zeros(0)]
    for (number, term), counts in zip(owners(data, problem), _counts(problem), strict=True):
        stated = context.need_data.observations[number].sigma
        share = np.zeros(term.scale.shape) if stated is None else (stated[term.index] / term.sigma) ** 2
        out.append(share[counts].ravel())
    return np.concatenate(out)


def _counts(problem: Problem) -> Iterator[Bools]:
    """Which rows of every term count."""
    for t in problem.terms:
        yield t.used & problem.in_use[t.configuration]
