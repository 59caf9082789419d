"""Rows that do not belong to the others, by name: where they stand, how far off they are, and what may have happened."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from robocal.calibrate.farness import Farness, far_from
from robocal.calibrate.noise import owners
from robocal.estimate.problem import Problem
from robocal.measure.base import Rows, kind_of
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet, Observations
from robocal.measure.machine import Machine
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

if TYPE_CHECKING:
    from robocal.calibrate.fit import Fit

__all__ = ["Outlier", "find_outliers", "named"]

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]
MAD = 0.6745  # the median distance of a standard normal number from 0
FEW = 0.5  # zeros in more of an instrument's rows are what it reads (a ball in a socket), and no dropped beam


@dataclass(frozen=True)
class Outlier:
    """An observation that does not belong to the others: where it stands and what was measured (SI), how many robust standard
    deviations it is away from a fit without it, the chance that the farthest of all rows would be, whether it was set aside,
    whether the verdict counts its error (of a row that was set aside too, where one of the two models comes near it), and the
    likeliest cause."""

    configuration: str
    group: str
    kind: str
    target: str
    source: str
    row: int | None
    distance: float
    p_value: float
    leverage: float
    value: tuple[float, ...] = ()
    set_aside: bool = True
    counted: bool = False
    cause: Remark | None = None


def find_outliers(
    model: Machine, data: DataSet, found: Fit, counted: Mapping[str, Bools] | None = None
) -> tuple[Outlier, ...]:
    """Rows that are far from a fit to all others, the farthest first; `data` marks those that were set aside, `counted`
    are those whose error the verdict counts, by unit in the order of `evidence.errors`."""
    x = found.solution.x
    away = far_from(data, found.problem, x, np.arange(len(data.configurations)))
    return named(model, data, found.problem, x, away, counted)


def named(
    model: Machine,
    data: DataSet,
    problem: Problem,
    x: Array,
    away: Farness,
    counted: Mapping[str, Bools] | None = None,
) -> tuple[Outlier, ...]:
    """The rows of a problem that are far from its solution x (1, P), or set aside, by name."""
    out = []
    seen = dict.fromkeys(counted or (), 0)
    for t, (own, term) in enumerate(owners(data, problem)):
        told = np.zeros(len(term.index), dtype=bool)
        for *_, unit in term.parts:
            if counted is not None and unit in counted:
                told |= counted[unit][seen[unit] : seen[unit] + len(told)]
                seen[unit] += len(told)
        obs = data.observations[own]
        # What is far and was used all the same is no gross row, but it is told.
        strange = np.flatnonzero(away.strange[t] | ~term.used)
        said = _causes(obs, term, x, strange, _of_targets(model, data, own, term.index[strange], problem, x))
        for i in strange:
            row = int(term.index[i])
            out.append(
                Outlier(
                    data.configurations.ids[int(term.configuration[i])], term.group, term.kind, term.target, obs.source,
                    None if obs.rows is None else int(obs.rows[row]),
                    float(away.distance[t][i]), float(away.chance[t][i]), float(away.leverage[t][i]),
                    tuple(float(v) for v in obs.value[row]), not bool(term.used[i]),
                    bool(told[i]), said[int(i)],
                )
            )  # fmt: skip
    return tuple(sorted(out, key=lambda o: -o.distance))


def _causes(obs: Observations, term: Rows, x: Array, strange: Ints, of_targets: Array | None) -> dict[int, Remark]:
    """The likeliest cause of every strange row of a term: from what it says itself, else from what the others predict;
    `of_targets` (n, T, d) is what the n strange rows would read of each target."""
    alone = {int(i): cause(obs, int(term.index[i])) for i in strange}
    start, stop, _ = kind_of(obs).parts[0]
    if not alone or stop - start < 2:
        return alone
    from robocal.calibrate.causes import causes_of

    value, predicted = (v[:, start:stop] for v in (term.value[0], term.predict(np.atleast_2d(x))))
    spread = (
        np.median(np.abs(value - predicted)[term.used], axis=0) / MAD if term.used.any() else np.zeros(stop - start)
    )
    rows = term.index if obs.rows is None else obs.rows[term.index]
    seen, mine = None, None
    if of_targets is not None and obs.target is not None:
        seen, mine = np.full((len(value), *of_targets.shape[1:]), np.nan)[..., start:stop], obs.target[term.index]
        seen[strange] = of_targets[..., start:stop]
    names = tuple(t.name for t in obs.targets)
    found = causes_of(strange, value, predicted, spread, of_targets=seen, target=mine)
    told = {n.row: n.remark(rows, names) for n in found}
    return {i: told.get(i, said) if said.code is Code.CAUSE_ALONE else said for i, said in alone.items()}


def _of_targets(model: Machine, data: DataSet, own: int, rows: Ints, problem: Problem, x: Array) -> Array | None:
    """What some rows of one instrument would read of each of its targets, (n, T, d); None where it has one target."""
    obs = data.observations[own]
    if obs.target is None or len(obs.targets) < 2 or not len(rows):
        return None
    n, count = len(rows), len(obs.targets)
    each = replace(obs.take(np.tile(rows, count)), target=np.repeat(np.arange(count), n))
    made = build(model, DataSet(data.configurations, (each,)))
    there = np.array([[np.atleast_2d(x)[0, problem.table.index[name]] for name in made.table.names]])
    out = np.empty((n * count, kind_of(obs).size))
    for term in made.terms:
        assert isinstance(term, Rows)
        out[term.index] = term.predict(there)
    return np.moveaxis(out.reshape(count, n, -1), 0, 1)


def cause(obs: Observations, row: int) -> Remark:
    """The likeliest cause of a gross row, from what it says itself."""
    for start, stop, _ in kind_of(obs).parts:
        zero = (obs.value[:, start:stop] == 0).all(axis=1)
        if stop - start > 1 and zero[row] and zero.mean() < FEW:
            return Remark.of(Code.CAUSE_ZEROS)
    return Remark.of(Code.CAUSE_ALONE)
