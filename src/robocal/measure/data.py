"""What was measured: configurations of a machine, and observations made at them (SI, radians).

Every observed pose reads T_measuring_measured. A frame belongs to an instrument, a target to the thing that it sees;
both are named, and their parameters are called `name.x` ... `name.rz`. Mounted on "base", a frame stores
T_frame_base; mounted on "tool", T_tool_frame. A target mounted on "tool" stores T_tool_target, on "base"
T_base_target.

`fingerprints` say which measurements are the same, whatever file they stand in: a number of joint values and readings, rounded to a
millionth.

    h <- (h xor v) p mod 2^64,   v = rint(10^6 x),   over joints, the other configuration's joints, what else a row says, readings

as in FNV-1a, over whole numbers instead of bytes. The same pose measured again is another measurement: noise makes it one.
Source: Fowler, Noll and Vo (1991).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocal._record import record
from robocal._types import Array, Bools, Ints
from robocal.errors import ModelError
from robocal.parameters import Parameter, frame_parameters

__all__ = ["Configurations", "DataSet", "Frame", "Observations", "fingerprints", "same_rows"]

# What observations have of every row, in front.
PER_ROW = ("configuration", "sigma", "target", "rows", "second", "used", "digits", "rounding")


@record
class Frame:
    """A named frame with six parameters: an instrument, or a target. `expected` is how far its value may be off (m,
    rad); `described` is false of one of which its file says no more than the name; `prior` are standard deviations around its value
    that somebody states, in m and rad."""

    name: str
    value: tuple[float, ...] = (0.0,) * 6
    free: tuple[bool, ...] = (False,) * 6
    mount: str = "base"
    expected: tuple[float, float] = (1.0, 1.0)
    described: bool = field(default=True, compare=False)
    prior: tuple[float, ...] | None = None

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Its six rows of a parameter table."""
        return frame_parameters(self.name, self.value, free=self.free, expected=self.expected, prior=self.prior)


@record
class Configurations:
    """Where the machine stood: joint values (m, n) in rad or m (None for a machine with free poses), and named columns
    (m,); `groups` (m) are labels of what belongs together, such as a placement of the target, or "" where nothing is
    said; `digits` (m, n) is what one unit in the last digit of each joint value means, as it was written (None: not
    known)."""

    ids: tuple[str, ...]
    joints: Array | None = None
    columns: Mapping[str, Array] = field(default_factory=dict)
    start: Array | None = None  # frame vectors (m, 6) from which free poses start
    groups: tuple[str, ...] | None = None
    digits: Array | None = None
    # What was worked out of these configurations once; a copy with anything else begins with nothing.
    memo: dict[object, Any] = field(init=False, repr=False, compare=False, default_factory=dict)

    def __len__(self) -> int:
        return len(self.ids)

    @property
    def starts(self) -> Array:
        """Where poses of their own start, frame vectors (m, 6): at the identity where nothing is said."""
        return np.zeros((len(self), 6)) if self.start is None else self.start

    def __add__(self, other: Configurations) -> Configurations:
        """The ones after the others, kept apart; a column that only one of them has is NaN in the other."""
        n, m = len(self), len(other)
        nan_a, nan_b = np.full(n, np.nan), np.full(m, np.nan)
        names = {**self.columns, **other.columns}
        columns = {k: np.concatenate([self.columns.get(k, nan_a), other.columns.get(k, nan_b)]) for k in names}
        joints = _stack(self.joints, other.joints, n, m, np.nan)
        # Free poses start at the identity where nothing is said.
        start = _stack(self.start, other.start, n, m, 0.0)
        labels = None
        if self.groups is not None or other.groups is not None:
            labels = (self.groups or ("",) * n) + (other.groups or ("",) * m)
        digits = _stack(self.digits, other.digits, n, m, 0.0)
        return Configurations(self.ids + other.ids, joints, columns, start, labels, digits)

    def take(self, index: Ints) -> Configurations:
        """A subset, in the given order."""
        columns = {k: v[index] for k, v in self.columns.items()}
        joints, start, digits = (None if v is None else v[index] for v in (self.joints, self.start, self.digits))
        rows = np.asarray(index).tolist()  # whole numbers of Python's own, which index a tuple faster
        groups = None if self.groups is None else tuple([self.groups[i] for i in rows])
        return Configurations(tuple([self.ids[i] for i in rows]), joints, columns, start, groups, digits)


@record
class Observations:
    """Many observations of one kind by one instrument.

    configuration (k,) indexes the data set's configurations; value (k, d) and sigma (k, d) as the kind says (sigma
    None: not stated); target (k,) indexes `targets`; `extra` holds the kind's own columns, each with k rows;
    `options` its scalars. `rows` (k,) are row numbers in `source`. A kind that compares two configurations keeps the
    other one in `second` (k,). A second axis in front of value, (B, k, d), gives
    every problem of a batch its own measurements. `used` (k,) is False for rows that are set aside: they are predicted, and
    weigh nothing (None: all are used). `digits` (k, d) is what one unit in the last digit of each value means, as it was
    written (None: not known); `rounding` (k, d) is the standard deviation that rounding alone leaves in each component, that of
    the joint values included, where it was computed. `scale` is the standard deviation of the factor by which all lengths may be
    read too long (0: the scale is known; None: as is usual for the kind).
    """

    kind: str
    configuration: Ints
    value: Array
    sigma: Array | None = None
    frame: Frame | None = None
    targets: tuple[Frame, ...] = ()
    target: Ints | None = None
    extra: Mapping[str, Array] = field(default_factory=dict)
    options: Mapping[str, object] = field(default_factory=dict)
    group: str = ""
    source: str = ""
    rows: Ints | None = None
    second: Ints | None = None
    used: Bools | None = None
    digits: Array | None = None
    rounding: Array | None = None
    scale: float | None = None

    @property
    def label(self) -> str:
        """The sensor group: the instrument's name, or the kind."""
        return self.group or (self.frame.name if self.frame else self.kind)

    def __len__(self) -> int:
        return len(self.configuration)

    def take(self, index: Ints) -> Observations:
        """A subset, in the given order."""
        there = {n: v for n in PER_ROW if (v := getattr(self, n)) is not None}
        extra = {k: v[index] for k, v in self.extra.items()}
        return replace(self, value=self.value[..., index, :], extra=extra, **{n: v[index] for n, v in there.items()})

    def renumber(self, number: Ints) -> Observations:
        """The same rows of configurations that have other numbers, number (m,) of the one that was i."""
        second = None if self.second is None else number[self.second]
        return replace(self, configuration=number[self.configuration], second=second)


def same_rows(one: Sequence[Observations], other: Sequence[Observations], but: Collection[str] = ()) -> bool:
    """Whether these hold the very same rows, objects and arrays; fields that `but` names are not asked."""
    pairs = zip(one, other, strict=False)
    return len(one) == len(other) and all(
        a is b or all(getattr(a, n) is getattr(b, n) for n in _FIELDS if n not in but) for a, b in pairs
    )


_FIELDS = tuple(f.name for f in fields(Observations))


@record
class DataSet:
    """Configurations with the observations made at them."""

    configurations: Configurations
    observations: tuple[Observations, ...]

    def take(self, configurations: Ints) -> DataSet:
        """The data of some configurations only, renumbered."""
        new = np.full(len(self.configurations), -1, dtype=np.int64)
        new[configurations] = np.arange(len(configurations))
        kept = []
        for obs in self.observations:
            inside = new[obs.configuration] >= 0
            if obs.second is not None:
                inside &= new[obs.second] >= 0
            kept.append(obs.take(np.flatnonzero(inside)).renumber(new))
        return DataSet(self.configurations.take(configurations), tuple(o for o in kept if len(o)))

    def configurations_of(self, sources: Collection[str]) -> Ints:
        """The configurations at which rows of some files were measured."""
        mine = [part for o in self.observations if o.source in sources for part in (o.configuration, o.second)]
        return np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *(part for part in mine if part is not None)]))

    def by_id(self) -> DataSet:
        """Configurations with one id as one, in the order of their first mention; for machines whose configurations are
        nothing but a name. What the first does not know a later one may."""
        c = self.configurations
        number = {name: i for i, name in enumerate(dict.fromkeys(c.ids))}
        index = np.array([number[name] for name in c.ids], dtype=np.int64)
        first = np.unique(index, return_index=True)[1]
        made = c.take(first)
        columns = dict(made.columns)
        for name, values in c.columns.items():
            known = np.flatnonzero(np.isfinite(values))[::-1]
            columns[name] = np.full(len(number), np.nan)
            columns[name][index[known]] = values[known]
        return DataSet(replace(made, columns=columns), tuple(o.renumber(index) for o in self.observations))

    def __add__(self, other: DataSet) -> DataSet:
        """Two data sets as one; configurations are kept apart."""
        numbers = len(self.configurations) + np.arange(len(other.configurations))
        moved = tuple(o.renumber(numbers) for o in other.observations)
        return DataSet(self.configurations + other.configurations, self.observations + moved)


def _stack(a: Array | None, b: Array | None, rows_a: int, rows_b: int, absent: float) -> Array | None:
    """One above the other; what only one of them has is `absent` in the other."""
    if a is None and b is None:
        return None
    width = (a if a is not None else b).shape[1]  # type: ignore[union-attr]
    upper = np.full((rows_a, width), absent) if a is None else a
    lower = np.full((rows_b, width), absent) if b is None else b
    if upper.shape[1] != lower.shape[1]:
        expected = upper.shape[1]
        raise ModelError("two data sets with different numbers of joints", found=lower.shape[1], expected=expected)
    return np.vstack([upper, lower])


START, PRIME = np.uint64(0xCBF29CE484222325), np.uint64(0x100000001B3)
GRID = 1e6  # per m, rad or pixel


def fingerprints(data: DataSet) -> list[NDArray[np.uint64]]:
    """One number per row of each of the observations."""
    return [_of(data, obs) for obs in data.observations]


def _of(data: DataSet, obs: Observations) -> NDArray[np.uint64]:
    joints = data.configurations.joints
    parts = [] if joints is None else [joints[obs.configuration]]
    if joints is not None and obs.second is not None:
        parts.append(joints[obs.second])
    more = [np.asarray(v, dtype=float).reshape(len(obs), -1) for _, v in sorted(obs.extra.items())]
    rows = np.hstack([*parts, *more, obs.value if obs.value.ndim == 2 else obs.value[0]])
    numbers = np.rint(np.nan_to_num(rows) * GRID).astype(np.int64).view(np.uint64)
    out = np.full(len(rows), START)
    with np.errstate(over="ignore"):
        for column in numbers.T:
            out = (out ^ column) * PRIME
            out ^= out >> np.uint64(32)  # the high half decides the low one too
    return out
