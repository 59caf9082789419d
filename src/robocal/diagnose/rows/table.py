"""The rows of one file, while it is read: outside the limits of the joints, repeats of one place that differ by too much or not even
in the last digit, an instrument that reads one and the same wherever the arm stands (it was stuck, or columns were filled in).
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record
from robocal._types import Array, Bools, Ints
from robocal.diagnose.check_registry import Context, Finding, Given, M_co, Machines, When, check, doubt, refuse
from robocal.diagnose.limits import COPIES, COPY_CHANCE, QUIETEST, REPEAT_SIGMA, STILL_MOVED, STILL_PLACES
from robocal.measure.base import kind_of
from robocal.measure.data import Configurations, Observations
from robocal.measure.machine import Model, joints_of
from robocal.measure.reach import limits_of
from robocal.remarks.code import Code
from robocal.remarks.english import declare

__all__ = ["STILL", "TableContext", "joint_limits", "outside", "repeat_findings", "repeats", "still"]


@record
class TableContext(Context[M_co]):
    """Beside the data of a file: the joint values of its rows, (m, n), the numbers that it gives these rows, (m,), and its name."""

    joints: Array | None = None
    lines: Ints | None = None
    file: str = ""


SLACK = 1e-9  # tolerance: rad or m; limits that were written in other units


@check("joint-limits", When.FILE, order=10, needs=("joints", "lines"))
def joint_limits(context: TableContext[Model]) -> Iterator[Finding]:
    """How many rows, which joints, and the first row."""
    assert context.joints is not None and context.lines is not None
    off = outside(context.joints, limits_of(context.model))
    rows = np.flatnonzero(off.any(axis=1))
    if len(rows):
        names = tuple(joints_of(context.model)[i].name for i in np.flatnonzero(off.any(axis=0)))
        first = int(context.lines[rows[0]])
        yield doubt(Code.OUTSIDE_LIMITS, file=context.file, rows=len(rows), joints=names, row=first)


def outside(q: Array, limits: Array) -> Bools:
    """Which joint values (m, n) lie outside limits (n, 2)."""
    return np.asarray((q < limits[:, 0] - SLACK) | (q > limits[:, 1] + SLACK))


@check("repeats", When.FILE, order=20, needs=("data",))
def repeats(context: TableContext[Model]) -> Iterator[Finding]:
    """Copies and repeats that differ, of every instrument."""
    data = context.need_data
    for obs in data.observations:
        yield from repeat_findings(obs, data.configurations, context.file)


def repeat_findings(obs: Observations, configurations: Configurations, file: str) -> Iterator[Finding]:
    """Repeated joints, or of a machine without joints configurations (target, point, other configuration), whose results differ by more
    than 10 sigma of a difference, or not even in the last digit."""
    joints = configurations.joints
    if len(obs) < 2 or obs.rows is None:
        return
    numbers = np.arange(len(configurations), dtype=float)[:, None] if joints is None else joints
    same = [numbers[at] for at in (obs.configuration, obs.second) if at is not None]
    if obs.target is not None:
        same.append(obs.target[:, None].astype(float))
    same += [v.reshape(len(obs), -1) for v in obs.extra.values()]
    _, group = np.unique(np.hstack(same), axis=0, return_inverse=True)
    order = np.argsort(group, kind="stable")
    sorted_group = group[order].ravel()
    starts = np.flatnonzero(np.r_[True, np.diff(sorted_group) > 0])
    if len(starts) == len(obs):
        return
    first = np.repeat(order[starts], np.diff(np.r_[starts, len(order)]))
    yield from _twice(obs, order, first, file)
    if obs.sigma is None:
        return
    # Angles are left out: they may differ by a turn, and a difference of rotation vectors has no sigma near a half one.
    compared = [i for a, b, unit in kind_of(obs).parts if unit != "rad" for i in range(a, b)]
    gap = np.abs(obs.value[order] - obs.value[first])[:, compared]
    sigma = np.hypot(obs.sigma[order], obs.sigma[first])[:, compared]
    bad = np.flatnonzero((gap > REPEAT_SIGMA * sigma).any(axis=1))
    if len(bad):
        a, b = int(obs.rows[first[bad[0]]]), int(obs.rows[order[bad[0]]])
        yield doubt(Code.REPEATS_DIFFER, file=file, count=len(bad), first=a, second=b)


def _twice(obs: Observations, order: Ints, first: Ints, file: str) -> Iterator[Finding]:
    """One line on rows that are copies of others. A single number whose noise nobody stated may read alike twice, and a contact has no
    reading; and where an instrument shows few digits, honest repeats agree in all of them now and then. A share that makes every sigma
    too small is refused, unless the quietest robot and instrument could agree as often."""
    assert obs.rows is not None
    if obs.value.shape[1] < 2 and obs.sigma is None:
        return
    if not obs.value.any():  # what was read is among the facts by which rows were put together
        again = np.flatnonzero(order != first)
        a, b = min(sorted((int(obs.rows[order[i]]), int(obs.rows[first[i]]))) for i in again)
        level = refuse if len(again) > COPIES * len(obs) else doubt
        yield level(Code.COPIED, file=file, count=len(again), first=a, second=b)
        return
    read = np.column_stack([first, obs.value[order]])
    _, index, key = np.unique(read, axis=0, return_index=True, return_inverse=True)
    original = index[key.ravel()]
    copy = (original != np.arange(len(order))) & (obs.value[order] != 0).any(axis=1)
    found = np.flatnonzero(copy)
    if not len(found):
        return
    size = np.bincount(first, minlength=len(obs))
    honest = (order != first) & ~copy
    pairs = float((size * (size - 1) / 2).sum())

    def beyond(chance: float) -> bool:
        return bool(scipy.special.pdtrc(len(found) - 1, pairs * chance) <= COPY_CHANCE)

    if not beyond(_agreeing(obs, order[honest], first[honest])):
        return
    level = refuse if len(found) > COPIES * len(obs) and beyond(_agreeing(obs)) else doubt
    a, b = min(sorted(int(obs.rows[order[i]]) for i in (original[k], k)) for k in found)
    yield level(Code.COPIED, file=file, count=len(found), first=a, second=b)


def _agreeing(obs: Observations, one: Ints | None = None, other: Ints | None = None) -> float:
    """The chance that two honest readings of one place agree to the last digit: of each number step / (2 sqrt(pi) sigma),
    with the step in which it is written and sigma as stated, or as other repeats scatter; without these as little as anything does."""
    chance = 1.0
    for start, stop, unit in kind_of(obs).parts:
        for i in range(start, stop):
            step = _step(obs.value[:, i])
            if one is not None and obs.sigma is not None:
                sigma = float(np.sqrt(np.mean(obs.sigma[:, i] ** 2)))
            elif one is not None and len(one):
                sigma = float(np.sqrt(np.mean((obs.value[one, i] - obs.value[other, i]) ** 2) / 2))
            else:
                sigma = QUIETEST.get(unit, 0.0)
            chance *= min(1.0, step / (2 * math.sqrt(math.pi) * sigma)) if sigma > 0 else 1.0
    return chance


def _step(values: Array) -> float:
    """The power of ten in which numbers are written, 0 where they are written in none."""
    for digits in range(13):
        step = 10.0**-digits
        whole = values / step
        if np.abs(whole - np.round(whole)).max() < 1e-3:
            return step
    return 0.0


PLACED = ("position", "pose", "spherical", "bearing", "range", "pixels")  # kinds that read where the tool is
STILL = declare(
    "readings-still",
    "all readings are equal, though the joints move",
    "Give a different reading at each configuration.",
)


@check("still", When.READ, order=10, machines=Machines.JOINTED, given=Given.ACCEPTED, needs=("data",))
def still(context: Context[Model]) -> Iterator[Finding]:
    """A bar of fixed length may read so, and so may a contact."""
    joints = context.need_data.configurations.joints
    if joints is None:
        return
    for obs in context.need_data.observations:
        if obs.kind not in PLACED or obs.rows is None or len(obs) < STILL_PLACES:
            continue
        if np.ptp(obs.value, axis=0).any():
            continue
        where = joints[obs.configuration]
        if np.ptp(where, axis=0).max() >= STILL_MOVED and len(np.unique(where, axis=0)) >= STILL_PLACES:
            yield refuse(STILL, source=obs.source, kind=kind_of(obs).name, rows=len(obs))
            return
