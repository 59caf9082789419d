"""The way from a machine and its data to a problem.

A kind of measurement asks the builder for carriers, turns them into rows (residual and Jacobian), and never sees a
machine.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from robocal._types import Array
from robocal.errors import ModelError, nearest
from robocal.estimate.families import Family
from robocal.estimate.problem import Problem
from robocal.measure.builder import Builder
from robocal.measure.data import DataSet, Frame, Observations, same_rows
from robocal.measure.machine import Model, Rig, freedom_of
from robocal.measure.rows import KINDS, Kind, Rows, kind_of, register
from robocal.parameters import Parameter, ParameterTable, Together

__all__ = [
    "KINDS",
    "Builder",
    "Kind",
    "Model",
    "Rig",
    "Rows",
    "kind_of",
    "predict_rows",
    "problem",
    "register",
    "synthesise",
]


def problem(
    machine: Model,
    data: DataSet,
    *,
    free: Sequence[str] | None = None,
    values: Mapping[str, float] | None = None,
    local_targets: Sequence[str] = (),
) -> Problem:
    """The least-squares problem of a machine and its data.

    The table holds the machine's parameters, then those of frames, targets and kinds; `free` names the columns
    (default: those that say so). Where a configuration has a pose of its own, what is free of it is a local block;
    `local_targets` names targets (markers) that are local blocks too, a family of their own, instead of free columns.
    """
    plain = free is None and values is None and not local_targets
    if plain and (same := _recall(machine, data)) is not None:
        return same
    rows: dict[str, Parameter] = {p.name: p for p in machine.table.rows}
    known: dict[str, tuple[Frame, bool]] = {}
    numbers: dict[str, Parameter] = {}
    for obs in data.observations:
        kind = kind_of(obs)
        things = [(f, False) for f in (*obs.targets, *kind.frames(obs))]
        for frame, sees in [(obs.frame, True), *things] if obs.frame else things:
            _one_meaning(machine, known, frame, sees)
            if frame.name not in local_targets:
                rows.update({p.name: p for p in frame.parameters if p.name not in rows})
        for p in kind.parameters(obs):
            # A number that the machine has is the machine's, whatever it is worth there: a camera that is itself to be identified.
            unit = machine.table[p.name].unit if p.name in machine.table else p.unit
            if numbers.setdefault(p.name, p) != p or unit != p.unit:
                expected = "two names, or equal values"
                raise ModelError("two different numbers have one name", key=p.name, expected=expected)
            rows.setdefault(p.name, p)
    table = _table(data, tuple(rows.values()), machine.table.together + _shared_priors(machine, data))
    if values:
        table = table.with_values(values)
    families = []
    if free_pose := freedom_of(machine):
        families.append(Family(data.configurations.starts, free_pose))
    if local_targets:
        families.append(_targets(data, local_targets))
    axes = families[-1].axes if local_targets else ()
    builder = Builder(machine, table, data.configurations, tuple(local_targets), axes)
    terms = tuple(term for obs in data.observations for term in kind_of(obs).terms(builder, obs))
    names = table.free if free is None else table.with_free(free).free
    made = Problem(table, names, tuple(families), terms=terms, configurations=len(data.configurations))
    if plain:
        data.configurations.memo["problem"] = machine, data.observations, made
    return made


def _recall(machine: Model, data: DataSet) -> Problem | None:
    """The last problem of these configurations, where it was made of the same rows and machine."""
    known = data.configurations.memo.get("problem")
    if known is None or known[0] is not machine or not same_rows(known[1], data.observations):
        return None
    made: Problem = known[2]
    return made


def _shared_priors(machine: Model, data: DataSet) -> tuple[Together, ...]:
    """The priors that numbers of instruments share, each once, but of numbers that are the machine's own."""
    found: dict[str, Together] = {}
    for prior in {id(t): t for obs in data.observations for t in kind_of(obs).together(obs)}.values():
        for name in prior.names:
            if found.setdefault(name, prior) != prior:
                raise ModelError("two different priors of one number", key=name, expected="two names, or equal priors")
    # One prior stands under each of its names: a map's has a third of a million numbers, whose hash takes long.
    each = {id(prior): prior for prior in found.values()}
    unique = (prior.without(machine.table.names) for prior in each.values())
    return tuple(prior for prior in unique if len(prior.names) > 1)


def _table(data: DataSet, rows: tuple[Parameter, ...], together: tuple[Together, ...]) -> ParameterTable:
    """The table of these rows: where the last problem of these configurations had the same, that one, with all it knows."""
    known: ParameterTable | None = data.configurations.memo.get("table")
    if known is None or known.rows != rows or known.together != together:
        known = data.configurations.memo["table"] = ParameterTable(rows, together)
    return known


def _targets(data: DataSet, names: Sequence[str]) -> Family:
    """Targets that are local blocks, free in the same components, all of them where nobody says which."""
    by_name = {f.name: f for obs in data.observations for f in obs.targets}
    for name in names:
        if name not in by_name:
            raise ModelError("no such target", found=name, expected="a target", suggestion=nearest(name, by_name))
    free = {by_name[n].free for n in names} - {(False,) * 6}
    if len(free) > 1:
        message = "targets that are local blocks must be free in the same components"
        raise ModelError(message, found=", ".join(sorted(names)[:4]), expected="the same `free` for all of them")
    axes = tuple(np.flatnonzero(free.pop()).tolist()) if free else tuple(range(6))
    return Family(np.array([by_name[n].value for n in names]), axes)


def _one_meaning(machine: Model, known: dict[str, tuple[Frame, bool]], frame: Frame, sees: bool) -> None:
    """One name stands for one frame: the same number under two meanings would be fitted to both."""
    if any(p.name in machine.table for p in frame.parameters):
        expected = "another name"
        raise ModelError("a frame or target has the name of a part of the machine", key=frame.name, expected=expected)
    # An instrument on the base stores where the base stands in it, everything else where it stands itself. Both are
    # a mere shift where rotations are held at zero: a socket may be an instrument at rest and the end of a bar.
    turned = any(frame.value[3:]) or any(frame.free[3:])
    inward = sees and frame.mount == "base" and turned
    first, other = known.setdefault(frame.name, (frame, inward))
    if (first.value, first.free, first.mount, other) != (frame.value, frame.free, frame.mount, inward):
        expected = "two names, or equal values"
        raise ModelError("two different frames or targets have one name", key=frame.name, expected=expected)


def synthesise(
    machine: Model,
    data: DataSet,
    rng: np.random.Generator | None = None,
    *,
    x: Array | None = None,
    noise: float = 1.0,
    local_targets: Sequence[str] = (),
) -> DataSet:
    """The data that the instruments of `data` would record on this machine: its values are replaced; without rng there
    is no noise.

    x (1, P) sets parameters and local blocks together (default: the tables' values and the configurations' starts).
    """
    made = problem(machine, data, local_targets=local_targets)
    x = made.start if x is None else np.atleast_2d(x)
    axes = made.families[-1].axes if local_targets else ()
    builder = Builder(machine, made.table, data.configurations, tuple(local_targets), axes)
    out = []
    for obs in data.observations:
        kind = kind_of(obs)
        value = np.empty((len(obs), kind.size))
        for term in kind.terms(builder, obs):
            value[term.index] = term.predict(x)
        if rng is not None and obs.sigma is not None:
            value = kind.disturb(value, noise * obs.sigma * rng.standard_normal(value.shape))
        out.append(replace(obs, value=value))
    return DataSet(data.configurations, tuple(out))


def predict_rows(machine: Model, data: DataSet, obs: Observations, known: ParameterTable, x: Array) -> Array:
    """What some rows would read, (k, d), where x (1, P) has the values of the table `known` of the data, and the poses of configurations
    behind it. The rows may be of other configurations and targets than any that were measured."""
    made = problem(machine, DataSet(replace(data.configurations), (obs,)))
    values = np.atleast_2d(x)
    there = np.concatenate([values[:, [known.index[n] for n in made.table.names]], values[:, len(known) :]], axis=1)
    out = np.empty((len(obs), kind_of(obs).size))
    for term in made.terms:
        assert isinstance(term, Rows)
        out[term.index] = term.predict(there)
    return out
