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
from robocal.measure.base import problem as build
from robocal.measure.data import Configurations
from robocal.measure.machine import Model
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity

__all__ = ["joint_rates", "time_offset"]

STEP = 1e-6  # rad or m, by which joints move in the difference of residuals


@check_fit_twice(doubt=("time-offset", 230), refuse=("wrong-time", 160), machines=Machines.JOINTED)
@once
def time_offset(context: Context[Model]) -> list[Finding]:
    """The instrument whose readings belong most clearly to another moment, by the joint rates along a path. It is refused where that
    explains most of what is left: held-out rows are late as well."""
    fit = context.need_fit
    joints, rates = fit.data.configurations.joints, joint_rates(fit.data.configurations)
    if rates is None or joints is None:
        return []
    speed, timed = rates
    free, values = fit.problem.free, context.values

    def problem_at(step: float) -> Problem:
        moved = replace(fit.data, configurations=replace(fit.data.configurations, joints=joints + step * speed))
        return build(context.model, moved, values=values).with_weights(fit.problem.weights).with_free(free)

    here, step = problem_at(0.0), STEP / float(np.abs(speed).max())
    if here.blocks:
        return []  # a pose of its own takes up whatever the arm's way could say
    seen = here.linearize(here.start)
    one, other = (p.linearize(p.start).r for p in (problem_at(step), problem_at(-step)))
    every = (one - other) / (2 * step)
    # Of every number, in the order of `linearize`, the instrument to which it belongs.
    count = [int((t.used & here.in_use[t.configuration]).sum()) * t.scale.shape[1] for t in here.terms]
    owner = np.repeat([t.group for t in here.terms], count)
    groups = list(dict.fromkeys(t.group for t in here.terms))
    late = np.stack([np.where(owner == group, every, 0.0) for group in groups], axis=1)
    found = score(seen.j, seen.r, here.scales, late)
    if found is None or found.t < limits.NUMBER_SIGMA or found.share < limits.LATE_DOUBT_SHARE:
        return []
    size = Quantity(abs(found.change), "s" if timed else "rows")
    before, after = (size, None) if found.change < 0 else (None, size)
    level, code = (refuse, Code.LATE) if found.share > limits.LATE_SHARE else (doubt, Code.LATE_DOUBTED)
    return [level(code, group=groups[found.column], before=before, after=after, z=found.t, share=found.share)]


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
