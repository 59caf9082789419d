"""What the digits of a file carry: the error that rounding alone leaves in what is predicted and measured.

    e_i^2 = sum_c h_ic^2 / 12 + sum_j |J_ij|^2 h_ij^2 / 12 + (8 eps |y_i|)^2

with h what one unit in the last digit means, of the components c of row i and of its joint values j, J the derivative of
the row by a joint, y what was measured. A number that is rounded to the nearest is off by h / sqrt(12), evenly spread. The
last part is what double precision leaves of a sum of lengths.

Digits say how exact numbers may be, never that they are wrong: joints that were commanded to whole degrees are exact. So
they are no floor of the noise. They are asked where what is left lies below anything that an arm repeats, and which rows may
be off by more than others where what is left is of the size of rounding (`add_rounding`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocal._types import Array, Bools
from robocal.diagnose.limits import FINEST_ERROR
from robocal.estimate.problem import Problem
from robocal.fit.fit import Fit
from robocal.fit.misfit import errors
from robocal.fit.noise import owners
from robocal.fit.subsample import subsample
from robocal.measure.base import kind_of
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet, Observations
from robocal.measure.machine import Model

__all__ = ["add_rounding", "rounding_rms"]

MARGIN = 10.0  # tolerance: times as sensitive as the worst of a few rows
GLANCE = 100  # grid: rows of an instrument and target that are few
STEP = 1e-6  # rad or m
MOST = 100_000  # rows at once
EPS = float(np.finfo(float).eps)


def add_rounding(model: Model, data: DataSet, problem: Problem, x: Array, few: DataSet | None = None) -> DataSet:
    """The data with what rounding leaves in every component of every row, at x (1, P) of their problem; unchanged where the
    digits are not known, and where a few of many rows say already that it is nothing beside the noise."""
    if data.configurations.digits is None and all(o.digits is None for o in data.observations):
        return data
    if few is not None and _nothing(model, data, few, problem, x):
        return data
    square = _square(model, data, problem, x)
    out = [np.zeros((len(o), kind_of(o).size)) for o in data.observations]
    for (own, term), v in zip(owners(data, problem), square, strict=True):
        out[own][term.index] = np.sqrt(v)
    return replace(
        data, observations=tuple(replace(o, rounding=r) for o, r in zip(data.observations, out, strict=True))
    )


def _nothing(model: Model, data: DataSet, few: DataSet, problem: Problem, x: Array) -> bool:
    """Whether rounding would stay below the noise of every row, were each MARGIN times as sensitive as the worst of few and
    written as coarsely as the worst of all."""
    few = subsample(model, few, np.arange(len(few.configurations)), GLANCE)[0]
    digits = data.configurations.digits
    coarse = None if digits is None else np.broadcast_to(digits.max(axis=0, initial=0.0), digits.shape)
    where = replace(few.configurations, digits=coarse)
    worst = [
        replace(o, digits=None if a.digits is None else np.broadcast_to(a.digits.max(axis=0), o.value.shape))
        for a, o in zip(data.observations, few.observations, strict=True)
    ]
    some = build(model, few)
    square = _square(model, DataSet(where, tuple(worst)), some, x)
    most = [np.zeros(kind_of(o).size) for o in few.observations]
    for (own, _), v in zip(owners(few, some), square, strict=True):
        most[own] = np.maximum(most[own], v.max(axis=0, initial=0.0))
    return all(bool((MARGIN * np.sqrt(most[own]) < t.sigma).all()) for own, t in owners(data, problem))


def rounding_rms(model: Model, data: DataSet, found: Fit, told: Bools) -> float | None:
    """Root mean square over the told rows (N,), those with lengths as in `evidence.errors`, of what rounding leaves, in m;
    None where it is so coarse that nothing can be said."""
    problem, x = found.problem, found.solution.x
    size = max((float(np.abs(o.value[..., :3]).max(initial=0.0)) for o in data.observations), default=0.0)
    square = _square(model, data, problem, x)
    left = [replace(r, value=np.sqrt(v)) for r, v in zip(problem.residuals(x), square, strict=True)]
    length = errors(left, "m")[0]
    level = float(np.sqrt(np.mean(length[told] ** 2 + (8 * EPS * max(size, 1.0)) ** 2)))
    return level if level < FINEST_ERROR else None


def _square(model: Model, data: DataSet, problem: Problem, x: Array) -> list[Array]:
    """The variance that rounding leaves in every component of the rows of every term, (m, d): of the measured values, where
    the file says them as they are compared, and of the joint values."""
    here = problem.residuals(x)
    out = []
    for (own, term), r in zip(owners(data, problem), here, strict=True):
        written = data.observations[own].digits
        out.append(np.zeros(r.value.shape) if written is None else written[term.index] ** 2 / 12)
    joints, digits = data.configurations.joints, data.configurations.digits
    if joints is None or digits is None:
        return out
    # Every joint a step further, as configurations behind one another: what is looked at is the same, and arranged once.
    count, rows = len(joints), sum(len(o) for o in data.observations)
    for some in np.array_split(np.arange(joints.shape[1]), min(joints.shape[1], 1 + joints.shape[1] * rows // MOST)):
        many = len(some)
        moved = np.repeat(joints[None], many, axis=0)
        moved[np.arange(many), :, some] += STEP
        where = replace(
            data.configurations.take(np.tile(np.arange(count), many)), joints=moved.reshape(-1, joints.shape[1])
        )
        again = build(model, DataSet(where, tuple(_again(o, many, count) for o in data.observations)))
        further = again.residuals(
            np.concatenate([x[:, : len(problem.table)], np.tile(x[:, len(problem.table) :], many)], axis=1)
        )
        for v, a, b in zip(out, here, further, strict=True):
            # Each joint's rows of a term lie in the order of that term.
            order = np.argsort(b.configuration // count, kind="stable")
            for i, there in zip(some, np.split(b.value[order], many), strict=True):
                v += ((there - a.value) / STEP * digits[a.configuration, i, None]) ** 2 / 12
    return out


def _again(obs: Observations, many: int, count: int) -> Observations:
    """The same rows so many times, each time of `count` further configurations."""
    further = np.repeat(np.arange(many) * count, len(obs))
    made = obs.take(np.tile(np.arange(len(obs)), many))
    second = None if made.second is None else made.second + further
    return replace(made, configuration=made.configuration + further, second=second)
