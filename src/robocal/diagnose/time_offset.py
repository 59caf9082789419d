"""Readings of a moving arm that belong to another moment than the joint values beside them: clocks that differ, a filter that lags.

    r(q - s v) = r - s c,    c = dr/dq v,    v = (q_{i+1} - q_{i-1}) / (t_{i+1} - t_{i-1})

s is a number like a radius that was stated: nought was taken, and the score test of `numbers` asks the residuals r whether they
want another one. v is the arm's own speed, per second where times were recorded, else per row; it is told only where neighbours in
time stand near each other, as on a path. Where poses were taken one by one, the way between two of them says nothing of either.
A path that is measured late is late at its held-out rows as well: no gain on unseen rows shows it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from robocal._types import Array
from robocal.diagnose import limits
from robocal.diagnose.check_registry import Context, Finding, Level, Machines, When, check, of_remarks, once
from robocal.diagnose.stated_numbers import score
from robocal.measure.base import problem as build
from robocal.measure.data import Configurations
from robocal.measure.machine import Model
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

if TYPE_CHECKING:
    from robocal.estimate.problem import Problem
    from robocal.fit.fit import Fit

__all__ = ["TimeOffset", "find_time_offset", "joint_rates", "time_offset"]

STEP = 1e-6  # rad or m, by which joints move in the difference of residuals


@dataclass(frozen=True)
class TimeOffset:
    """The readings of `group` are those of `by` seconds (`timed`) or rows before their joint values, by `z` sigma; `share` of the
    squares that are left is explained by it."""

    group: str
    by: float
    timed: bool
    z: float
    share: float

    @property
    def wrong(self) -> bool:
        """Whether no gain counts before it is put right."""
        return self.share > limits.LATE_SHARE

    @property
    def remark(self) -> Remark:
        """What is said of it."""
        size = Quantity(abs(self.by), "s" if self.timed else "rows")
        before, after = (size, None) if self.by > 0 else (None, size)
        code = Code.LATE if self.wrong else Code.LATE_DOUBTED
        return Remark.of(code, group=self.group, before=before, after=after, z=self.z, share=self.share)


def find_time_offset(model: Model, fit: Fit, told: tuple[Array, bool] | None) -> TimeOffset | None:
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
    return TimeOffset(names[some[found.column][0]], -found.change, timed, found.t, found.share)


@once
def time_offset(context: Context[Model]) -> TimeOffset | None:
    """That of the fit to everything."""
    return find_time_offset(context.model, context.need_fit, joint_rates(context.need_fit.data.configurations))


@check("time-offset", When.FIT, order=230, machines=Machines.JOINTED, needs=("fit",))
def doubt_time(context: Context[Model]) -> Iterator[Finding]:
    """Readings of another moment, where that explains little."""
    found = time_offset(context)
    if found is not None and not found.wrong:
        yield from of_remarks((found.remark,), Level.DOUBT)


@check("wrong-time", When.PROOF, order=160, machines=Machines.JOINTED, needs=("fit",))
def refuse_time(context: Context[Model]) -> Iterator[Finding]:
    """Readings of another moment, where that explains most of what is left: held-out rows are late as well."""
    found = time_offset(context)
    if found is not None and found.wrong:
        yield from of_remarks((found.remark,), Level.REFUSE)


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
