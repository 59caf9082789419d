"""The way from a machine and its data to a problem.

A kind of measurement asks the builder for carriers, turns them into rows (residual and Jacobian), and never sees a
machine.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from robocal.arms.chain import Chain, Element, compile_path, cosines, frame_element
from robocal.errors import ModelError, nearest
from robocal.estimate.problem import Problem
from robocal.estimate.rows import Term
from robocal.measure.carriers import Carrier, Inverse, LocalPose, Path, Product
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.parameters import Parameter, Table

__all__ = [
    "Builder",
    "Kind",
    "Rows",
    "problem",
    "register",
    "synthesise",
]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class Rows(ABC):
    """What the terms of every kind share: group, scale, unit, local blocks, measured values with an optional batch
    axis."""

    def __init__(self, carrier: Carrier, obs: Observations, index: Ints, default: Sequence[float]) -> None:
        self.carrier = carrier
        self.index = index
        # Kinds split their rows by target, so one name fits all of them.
        self.target = obs.targets[int(obs.target[index[0]])].name if obs.target is not None and len(index) else ""
        self.group = obs.label
        self.kind = obs.kind
        self.parts = KINDS[obs.kind].parts
        self.unit = np.ascontiguousarray(obs.configuration[index])
        self.local = np.full(len(index), -1, dtype=np.int64) if carrier.local is None else carrier.local
        self.value = np.ascontiguousarray(obs.value[..., index, :] if obs.value.ndim == 3 else obs.value[None, index])
        sigma = (
            np.broadcast_to(np.asarray(default, float), (len(index), len(default)))
            if obs.sigma is None
            else obs.sigma[index]
        )
        self.scale = np.ascontiguousarray(1.0 / sigma)

    @property
    def columns(self) -> Ints:
        return self.carrier.columns

    def bind(self, column_of: Ints) -> Term:
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        other.carrier = self.carrier.bind(column_of)
        return other

    def measured(self, which: Ints, first: int, rows: int) -> Array:
        """The measured values of these problems and rows, (B or 1, m, d)."""
        value = self.value[:, first : first + rows]
        return value if len(value) == 1 else value[which]

    @abstractmethod
    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        """What a term owes to a problem (`estimate.rows.Term`)."""

    def predict(self, x: Array) -> Array:
        """What a perfect instrument would read, (m, d)."""
        m = len(self.unit)
        r, _, _ = self.bind(np.full(x.shape[1], -1, dtype=np.int64)).evaluate(x, np.zeros(1, dtype=np.int64), 0, m)
        return np.asarray(r[0] + self.value[0])


@dataclass(frozen=True)
class Kind:
    """A way to measure: its name, how many numbers one observation has, its own parameters, and how its rows become
    terms."""

    name: str
    size: int
    terms: Callable[[Builder, Observations], list[Rows]]
    parameters: Callable[[Observations], Sequence[Parameter]] = lambda obs: ()
    parts: tuple[tuple[int, int, str], ...] = ((0, 3, "m"),)  # columns that share a unit: start, stop, SI unit
    disturb: Callable[[Array, Array], Array] = lambda value, noise: value + noise


KINDS: dict[str, Kind] = {}


def register(kind: Kind) -> Kind:
    """Makes a kind known under its name; one line at the end of its file, and its import in `measure/kinds.py`."""
    KINDS[kind.name] = kind
    return kind


def kind_of(obs: Observations) -> Kind:
    """The kind of some observations. Raises ModelError for an unknown name."""
    from robocal.measure import kinds  # noqa: F401  (fills KINDS)

    if obs.kind not in KINDS:
        raise ModelError(
            "unknown kind of measurement",
            found=obs.kind,
            expected=", ".join(KINDS),
            suggestion=nearest(obs.kind, KINDS),
        )
    return KINDS[obs.kind]


class Machine(Protocol):
    """What a problem asks of a model: its parameter table. A Chain adds elements; a machine without them has one free
    pose per configuration."""

    @property
    def table(self) -> Table: ...


@dataclass(frozen=True)
class Builder:
    """Makes the carriers that kinds ask for."""

    machine: Machine
    table: Table
    configurations: Configurations
    local_targets: tuple[str, ...] = ()  # targets that are local blocks, when the poses are not

    def path(self, elements: Sequence[Element], configuration: Ints) -> Path:
        """A path of elements at some configurations."""
        program = compile_path(elements, self.table)
        phi = np.zeros((len(configuration), 0))
        if program.columns and isinstance(self.machine, Chain):
            c = self.configurations
            if c.joints is None:
                raise ModelError(
                    "the model needs joint values that the data lack", expected=", ".join(self.machine.joint_names)
                )
            phi = self.machine.phi(c.joints, c.columns, program)[configuration]
            if np.isnan(phi).any():
                row, column = np.argwhere(np.isnan(phi))[0]
                place = self.configurations.ids[configuration[row]]
                raise ModelError(
                    "a configuration lacks a value that the model needs", key=program.columns[column], found=place
                )
        phi = np.ascontiguousarray(phi[None])
        return Path(program, phi, cosines(phi))

    def tool(self, configuration: Ints, before: Sequence[Element] = (), after: Sequence[Element] = ()) -> Carrier:
        """The machine's tool or platform frame, with frames before and behind it."""
        if isinstance(self.machine, Chain):
            return self.path((*before, *self.machine.elements, *after), configuration)
        carrier: Carrier = LocalPose(np.ascontiguousarray(configuration), len(self.table))
        if before:
            carrier = Product(self.path(before, configuration), carrier)
        return Product(carrier, self.path(after, configuration)) if after else carrier

    def view(self, obs: Observations, target: int, index: Ints) -> Carrier:
        """T_measuring_measured of some rows that share one target."""
        configuration = obs.configuration[index]
        seen = obs.targets[target] if obs.targets else None
        after = [frame_element(seen.name)] if seen else []
        if obs.frame is None:
            return self.tool(configuration, after=after)
        own = frame_element(obs.frame.name)
        if obs.frame.mount == "base":
            if seen is None or seen.mount == "tool":
                return self.tool(configuration, before=[own], after=after)
            return self.path([own, *after], configuration)
        sensor = Inverse(self.tool(configuration, after=[own]))
        if seen is None:
            return sensor
        if seen.name in self.local_targets:
            block = np.full(len(index), self.local_targets.index(seen.name), dtype=np.int64)
            return Product(sensor, LocalPose(block, len(self.table)))
        return Product(sensor, self.path(after, configuration))

    def split(self, obs: Observations) -> list[tuple[int, Ints]]:
        """The rows of every target, so that each group is one path."""
        if obs.target is None:
            return [(0, np.arange(len(obs)))]
        if len(obs) and not 0 <= obs.target.min() <= obs.target.max() < len(obs.targets):
            raise ModelError(
                "an observation of a target that is not listed", key=obs.label, expected=f"0 to {len(obs.targets) - 1}"
            )
        return [(t, np.flatnonzero(obs.target == t)) for t in range(len(obs.targets)) if (obs.target == t).any()]


def problem(
    machine: Machine,
    data: DataSet,
    *,
    free: Sequence[str] | None = None,
    values: Mapping[str, float] | None = None,
    local_targets: Sequence[str] = (),
) -> Problem:
    """The least-squares problem of a machine and its data.

    The table holds the machine's parameters, then those of frames, targets and kinds; `free` names the columns
    (default: those that say so). A machine without joints gets one free pose per configuration as local block;
    `local_targets` names targets (markers) that are eliminated instead of sharing the dense part.
    """
    rows: dict[str, Parameter] = {p.name: p for p in machine.table.rows}
    poses = not isinstance(machine, Chain)
    known: dict[str, Frame] = {}
    for obs in data.observations:
        for frame in (*((obs.frame,) if obs.frame else ()), *obs.targets):
            _one_meaning(machine, known.setdefault(frame.name, frame), frame)
            if frame.name not in local_targets:
                rows.update({p.name: p for p in frame.parameters if p.name not in rows})
        rows.update({p.name: p for p in kind_of(obs).parameters(obs) if p.name not in rows})
    table = Table(tuple(rows.values()))
    if values:
        table = table.with_values(values)
    builder = Builder(machine, table, data.configurations, tuple(local_targets))
    terms: list[Term] = []
    for obs in data.observations:
        terms.extend(kind_of(obs).terms(builder, obs))
    start = np.zeros(0)
    blocks = 0
    if poses:
        blocks = len(data.configurations)
        given = data.configurations.start
        start = (np.zeros((blocks, 6)) if given is None else given).ravel()
    elif local_targets:
        by_name = {f.name: f for obs in data.observations for f in obs.targets}
        blocks = len(local_targets)
        start = np.array([by_name[n].value for n in local_targets]).ravel()
    return Problem(
        table,
        tuple(terms),
        table.free if free is None else table.with_free(free).free,
        blocks=blocks,
        block_size=6 if blocks else 0,
        units=len(data.configurations),
        local_start=start,
    )


def _one_meaning(machine: Machine, first: Frame, frame: Frame) -> None:
    """One name stands for one frame: the same number under two meanings would be fitted to both."""
    if any(p.name in machine.table for p in frame.parameters):
        raise ModelError(
            "a frame or target has the name of a part of the machine", key=frame.name, expected="another name"
        )
    if (first.value, first.free, first.mount) != (frame.value, frame.free, frame.mount):
        raise ModelError(
            "two different frames or targets have one name", key=frame.name, expected="two names, or equal values"
        )


def synthesise(
    machine: Machine,
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
    builder = Builder(machine, made.table, data.configurations, tuple(local_targets))
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
