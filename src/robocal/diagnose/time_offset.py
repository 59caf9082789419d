"""Readings of a moving arm that belong to another moment than the joint values beside them: clocks that differ, a filter that lags.

    r(q - s v) = r - s c,    c = dr/dq v,    v = (q_{i+1} - q_{i-1}) / (t_{i+1} - t_{i-1})

s is a number like a radius that was stated: nought was taken, and the score test of `numbers` asks the residuals r whether they
want another one. v is the arm's own speed, per second where times were recorded, else per row; it is told only where neighbours in
time stand near each other, as on a path. Where poses were taken one by one, the way between two of them says nothing of either.
A path that is measured late is late at its held-out rows as well: no gain on unseen rows shows it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocal._types import Array
from robocal.diagnose import limits
from robocal.diagnose.check_registry import Context, Finding, Machines, check_fit_twice, doubt, once, refuse
from robocal.diagnose.stated_numbers import score
from robocal.estimate.problem import Problem
from robocal.fit.fit import Fit
from robocal.measure.base import problem as build
from robocal.measure.data import Configurations
from robocal.measure.machine import Model
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity

__all__ = ["find_time_offset", "joint_rates", "time_offset"]

STEP = 1e-6  # rad or m, by which joints move in the difference of residuals


def find_time_offset(model: Model, fit: Fit, told: tuple[Array, bool] | None) -> Finding | None:
    """The instrument whose readings belong most clearly to another moment, by the joint rates `told` along a path; None where none does,
    or the arm stood still."""
    joints = fit.data.configurations.joints
    if told is None or joints is None:
        return None
    speed, timed = told
    free = fit.problem.free
    values = dict(zip(fit.problem.table.names, map(float, fit.solution.x[0]), strict=False))

    def problem_at(step: float) -> Problem:
        moved = replace(fit.data, configurations=replace(fit.data.configurations, joints=joints + step * speed))
        return build(model, moved, values=values).with_weights(fit.problem.weights).with_free(free)

    here, step = problem_at(0.0), STEP / float(np.abs(speed).max())
    if here.blocks:
        return None  # a pose of its own takes up whatever the arm's way could say
    seen = here.linearize(here.start)
    one, other = (p.linearize(p.start).r for p in (problem_at(step), problem_at(-step)))
    every = (one - other) / (2 * step)
    # Of every number, in the order of `linearize`, the term to which it belongs.
    count = [int((t.used & here.in_use[t.configuration]).sum()) * t.scale.shape[1] for t in here.terms]
    term = np.repeat(np.arange(len(count)), count)
    names = [t.group for t in here.terms]
    some = [[n for n, other in enumerate(names) if other == name] for name in dict.fromkeys(names)]
    found = score(
        seen.j, seen.r, here.scales, np.stack([np.where(np.isin(term, mine), every, 0.0) for mine in some], axis=1)
    )
    if found is None or found.t < limits.NUMBER_SIGMA or found.share < limits.LATE_DOUBT_SHARE:
        return None
    size = Quantity(abs(found.change), "s" if timed else "rows")
    before, after = (size, None) if found.change < 0 else (None, size)
    level, code = (refuse, Code.LATE) if found.share > limits.LATE_SHARE else (doubt, Code.LATE_DOUBTED)
    group = names[some[found.column][0]]
    return level(code, group=group, before=before, after=after, z=found.t, share=found.share)


@check_fit_twice(doubt=("time-offset", 230), refuse=("wrong-time", 160), machines=Machines.JOINTED)
@once
def time_offset(context: Context[Model]) -> list[Finding]:
    """Readings of another moment; refused where that explains most of what is left: held-out rows are late as well."""
    fit = context.need_fit
    found = find_time_offset(context.model, fit, joint_rates(fit.data.configurations))
    return [] if found is None else [found]


def joint_rates(configurations: Configurations) -> tuple[Array, bool] | None:
    """The speed of every joint (m, n), and whether it is per second (else per row); nought where a neighbour is far; None where
    no path was measured."""
    q, t = configurations.joints, configurations.columns.get("time")
    if q is None or len(q) < limits.PATH_CONFIGURATIONS or not np.isfinite(q).all():
        return None
    timed = t is not None and bool(np.isfinite(t).all() and np.ptp(t) > 0)
    order = np.argsort(t, kind="stable") if timed and t is not None else np.arange(len(q))
    way, clock = q[order], t[order] if timed and t is not None else np.arange(len(q), dtype=np.float64)
    spread = q.std(axis=0)
    place = way / np.where(spread > 0, spread, 1.0)
    step = np.linalg.norm(np.diff(place, axis=0), axis=1)
    near = step < limits.PATH_STEP * np.sqrt(2 * (spread > 0).sum())
    inside = np.flatnonzero(near[:-1] & near[1:] & (clock[2:] > clock[:-2])) + 1
    if len(inside) < limits.PATH_SHARE * len(q):
        return None
    speed = np.zeros_like(q)
    gap = (clock[inside + 1] - clock[inside - 1])[:, None]
    speed[order[inside]] = (way[inside + 1] - way[inside - 1]) / gap
    return (speed, timed) if speed.any() else None
