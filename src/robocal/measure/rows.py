"""What every kind of measurement is made of: its rows (residual and Jacobian), its own numbers, and its place in the
registry."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from importlib import import_module
from typing import Any, Self

import numpy as np

from robocal._record import record
from robocal._types import Array, Bools, Ints
from robocal.errors import ModelError, look_up, one_of
from robocal.estimate.losses import Loss
from robocal.estimate.terms import Normal
from robocal.measure.builder import Builder
from robocal.measure.carriers import Carrier, join_blocks, locals_of
from robocal.measure.data import Frame, Observations
from robocal.measure.kinds import NAMES
from robocal.parameters import Parameter, Together

__all__ = [
    "KINDS", "Between", "Kind", "Number", "Rows", "SightRows", "kind_of", "number_names", "numbers", "per_target", "register", "scale_of",
]  # fmt: skip

NONE = np.empty(0, dtype=np.int64)
Carriers = Carrier | tuple[Carrier, Carrier] | tuple[()]
METRES = ((0, 1, "m"),)  # the parts of a kind that reads one length


class Rows(ABC):
    """What the terms of every kind share: group, scale, configuration, local blocks, measured values with an optional batch
    axis, one or two carriers and the kind's own numbers.

    The columns of J are those of the carriers, one after the other, then the free ones of `numbers` (rows of the
    parameter table). Two columns may feed one parameter: the problem adds them.
    """

    view: Any = None  # what several terms look through, whose normal equations are summed as one

    def __init__(
        self,
        carrier: Carriers | tuple[()],
        obs: Observations,
        index: Ints,
        numbers: Ints = NONE,
        sight: Ints | None = None,
    ) -> None:
        kind = KINDS[obs.kind]
        self.carriers: tuple[Carrier, ...] = carrier if isinstance(carrier, tuple) else (carrier,)
        self.index = index
        # Kinds split their rows by target, so one name fits all of them.
        self.target = obs.targets[int(obs.target[index[0]])].name if obs.target is not None and len(index) else ""
        self.group = obs.label
        self.kind, self.parts, self.metric = obs.kind, kind.parts, kind.metric
        self.configuration = np.ascontiguousarray(obs.configuration[index])
        # Which row of the carriers each row looks through: its own, where a kind does not say otherwise.
        self.sight = sight
        self._meet()
        self.value = np.ascontiguousarray(obs.value[..., index, :] if obs.value.ndim == 3 else obs.value[None, index])
        self.sigma = np.full((len(index), kind.size), kind.unstated) if obs.sigma is None else obs.sigma[index]
        self.used = np.ones(len(index), dtype=bool) if obs.used is None else np.ascontiguousarray(obs.used[index])
        # What is set aside is infinitely uncertain: it weighs nothing, and is predicted like the others.
        self.scale = np.ascontiguousarray(self.used[:, None] / self.sigma)
        self.rounding = None if obs.rounding is None else obs.rounding[index]
        self.numbers = numbers
        self.own = NONE  # which numbers are free
        self.columns: Ints = np.concatenate([NONE, *(c.columns for c in self.carriers)])
        # By the columns that are free; the same rows under another noise share it.
        self._bound: dict[bytes, dict[str, Any]] = {}

    def _meet(self) -> None:
        """Which local blocks the rows touch."""
        sight, count = self.sight, len(self.index)
        blocks = [block if block is None or sight is None else block[sight] for block in locals_of(self.carriers)]
        self.touches = blocks[0] is not None, blocks[1] is not None
        none = np.full(count, -1, dtype=np.int64)
        one, two = (none if block is None else block for block in blocks)
        self.local = one, two
        self.pairs, self.pair = np.zeros((0, 2), dtype=np.int64), none
        if all(self.touches):
            self.pairs, pair = np.unique(np.column_stack(self.local), axis=0, return_inverse=True)
            self.pair = np.ascontiguousarray(pair.ravel())

    def hold(self, family: int) -> Self:
        """The same rows, where the local blocks of a family (0 or 1) stay where x has them."""
        other = self._with(carriers=tuple(c.hold(family) for c in self.carriers), _bound={})
        other._meet()
        return other

    def _with(self, **changes: Any) -> Self:
        """A shallow copy with other attributes."""
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__, **changes)
        return other

    @property
    def lever(self) -> Array | None:
        """What turns all columns of a row into one error in the unit of the first part; most kinds need nothing."""
        return None

    @property
    def plain(self) -> Self:
        """The same rows, each number of which is as it was read; others have what is correlated taken apart."""
        return self

    @cached_property
    def reading(self) -> bool:
        """Whether the rows read the machine; a known distance between two sockets stands whatever it does."""
        return any(c.moves for c in self.carriers)

    @property
    def carrier(self) -> Carrier:
        """The first carrier; the only one of most kinds."""
        return self.carriers[0]

    def bind(self, column_of: Ints) -> Self:
        known, key = self._bound, column_of.tobytes()
        if key not in known:
            own = np.flatnonzero(column_of[self.numbers] >= 0)
            carriers = tuple([c.bind(column_of) for c in self.carriers])
            columns = np.concatenate([*(c.columns for c in carriers), column_of[self.numbers[own]]])
            known[key] = {"carriers": carriers, "own": own, "columns": columns}
        return self._with(**known[key])

    def with_every_row(self) -> Self:
        """The same rows, those set aside among them."""
        return self._with(used=np.ones_like(self.used), scale=np.ascontiguousarray(1 / self.sigma))

    def without(self, rows: Bools) -> Self:
        """The same term with these rows (m,) set aside."""
        used = self.used & ~rows
        return self._with(used=used, scale=np.ascontiguousarray(used[:, None] / self.sigma))

    def under(self, sigma: Array | None) -> Self:
        """The same term with another sigma of all observations (k, d) that it is one of."""
        own = self.sigma if sigma is None else sigma[self.index]
        return self._with(sigma=own, scale=np.ascontiguousarray(self.used[:, None] / own))

    def values_at(self, which: Ints, first: int, rows: int) -> Array:
        """The measured values of these problems and rows, (B or 1, m, d)."""
        value = self.value if rows == self.value.shape[1] else self.value[:, first : first + rows]
        return value if len(value) == 1 else value[which]

    def join(self, some: Sequence[Self]) -> Self:
        """Terms of one view, this among them, as one for normal equations."""
        raise NotImplementedError

    @abstractmethod
    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        """What a term owes to a problem (`estimate.rows.Term`)."""

    def accumulate(self, x: Array, which: Ints, weight: Array, loss: Loss, pair: int, out: Normal) -> bool:
        """Kinds that have a shorter way to the normal equations than row by row say so."""
        return False

    def stretch(self, x: Array, r: Array, first: int, rows: int) -> Array:
        """How residuals r (1, m, d) at x answer where all lengths are read a factor 1 + s too long, dr/ds (1, m, d): a reading that is
        a length by what is predicted of it; any other not at all."""
        out = np.zeros_like(r)
        # What was measured would bring its own noise into the column, and seem to tell a scale that nothing tells.
        for start, stop, unit in self.parts if self.metric else ():
            if unit == "m":
                out[..., start:stop] = (r + self.value[:1, first : first + rows])[..., start:stop]
        return out

    def predict(self, x: Array) -> Array:
        """What a perfect instrument would read, (m, d)."""
        m = len(self.configuration)
        r, _, _ = self.plain.bind(np.full(x.shape[1], -1, dtype=np.int64)).evaluate(
            x, np.zeros(1, dtype=np.int64), 0, m
        )
        return np.asarray(r[0] + self.value[0])


class SightRows(Rows):
    """Rows of which many look at one pose: `sight` says which of the carrier's rows each looks at."""

    sight: Ints

    def look(self, x: Array, first: int, rows: int) -> tuple[tuple[Array, Array, Array], Ints, int]:
        """The poses that some rows look at, with their Jacobians; which of them each row does, and the number of the first."""
        own = self.sight[first : first + rows]
        lo, hi = (int(own.min()), int(own.max()) + 1) if rows else (0, 0)
        return self.carrier.pose(x, lo, hi - lo), own - lo, lo


class Between(Rows):
    """Rows that look only at the vector from the origin of one carrier to that of another, in common axes."""

    def gap(self, x: Array, first: int, rows: int) -> tuple[Array, Array, Array]:
        """d = p_b - p_a (B, m, 3), its Jacobian for both carriers' columns, and for local blocks."""
        a, b = self.carriers
        ta, ja, la = a.pose(x, first, rows, turn=False)
        tb, jb, lb = b.pose(x, first, rows, turn=False)
        return tb[:, :, :3, 3] - ta[:, :, :3, 3], np.concatenate([-ja, jb], axis=3), join_blocks(self.carriers, -la, lb)

    def length(self, x: Array, first: int, rows: int) -> tuple[Array, Array, Array]:
        """|d| (B, m, 1) with its Jacobians; the gradient is the unit vector along d."""
        d, j, jl = self.gap(x, first, rows)
        length = np.linalg.norm(d, axis=-1, keepdims=True)
        # Two points in one place have no direction yet; the other measurements part them.
        along = (d / np.where(length > 0, length, 1.0))[:, :, None, :]
        return length, along @ j, along @ jl


@record
class Number:
    """One of a kind's own numbers: `options[option]` names its owner, and it is the parameter `owner.symbol`."""

    option: str
    symbol: str
    unit: str = "m"
    value: float = 0.0
    expected: float | None = None


def numbers(obs: Observations, known: Sequence[Number]) -> list[Parameter]:
    """The parameters of a kind's own numbers; a number whose owner is not named does not exist.

    `options["values"]` maps symbols to starting values (SI), `options["free"]` lists the symbols to identify (left out:
    those without a stated value), `options["priors"]` maps symbols to standard deviations. Raises ModelError for an
    unknown symbol.
    """
    here = [n for n in known if obs.options.get(n.option)]
    values, priors = (_mapping(obs, key) for key in ("values", "priors"))
    free = obs.options.get("free")
    stated = free if isinstance(free, tuple | list) else ()
    for symbol in (*values, *priors, *stated):
        if symbol not in {n.symbol for n in here}:
            names, key = [n.symbol for n in here], f"{obs.label}.{symbol}"
            facts = one_of(symbol, names) if names else {"expected": "none"}
            raise ModelError(f"unknown number of {obs.kind}", key=key, **facts)
    out = []
    for n in here:
        loose = n.symbol in stated if free is not None else n.symbol not in values
        name, value = f"{obs.options[n.option]}.{n.symbol}", float(values.get(n.symbol, n.value))
        out.append(Parameter(name, value, n.unit, loose, prior=priors.get(n.symbol), expected=n.expected))
    return out


def _mapping(obs: Observations, key: str) -> Mapping[str, float]:
    found = obs.options.get(key, {})
    if not isinstance(found, Mapping):
        raise ModelError("not a table of numbers", key=f"{obs.label}.{key}", found=found, expected="symbol: number")
    return found


def number_names(obs: Observations) -> list[str]:
    """The names of the parameters of a kind's own numbers, in their order."""
    return [f"{obs.options[n.option]}.{n.symbol}" for n in KINDS[obs.kind].numbers if obs.options.get(n.option)]


def per_target(
    rows: Callable[[Carriers, Observations, Ints, Ints], Rows],
    carriers: Callable[[Builder, Observations, int, Ints], Carriers] = Builder.view,
) -> Callable[[Builder, Observations], list[Rows]]:
    """What makes the terms of a kind that has one for every target: `rows` of what the builder makes of each for `carriers`."""

    def terms(builder: Builder, obs: Observations) -> list[Rows]:
        own = builder.rows(number_names(obs))
        return [rows(carriers(builder, obs, t, index), obs, index, own) for t, index in builder.split(obs)]

    return terms


@record
class Kind:
    """A way to measure: its name, how many numbers one observation has, its own frames and parameters, and how its rows
    become terms.

    `frames` are those beside the instrument's frame and the targets; they store T_base_frame or T_tool_frame.
    """

    name: str
    size: int
    terms: Callable[[Builder, Observations], list[Rows]]
    parameters: Callable[[Observations], Sequence[Parameter]] = lambda obs: numbers(obs, KINDS[obs.kind].numbers)
    parts: tuple[tuple[int, int, str], ...] = ((0, 3, "m"),)  # columns that share a unit: start, stop, SI unit
    disturb: Callable[[Array, Array], Array] = lambda value, noise: value + noise
    frames: Callable[[Observations], Sequence[Frame]] = lambda obs: ()
    numbers: tuple[Number, ...] = ()  # its own, of which those exist whose owner is named
    # Priors that several of these share.
    together: Callable[[Observations], Sequence[Together]] = lambda obs: ()
    unstated: float = 1e-4  # sigma of every component where none is stated, until the residuals tell better
    positional: bool = False  # whether its first three numbers say where the target is, in the instrument's frame
    # Whether readings are lengths themselves; else only a stated length says how long the machine is.
    metric: bool = False
    contact: bool = False  # the machine has to touch something, so not every configuration can be measured
    # Symbols of its own numbers that, like the machine's, somebody made: how far off they can be is known.
    manufactured: tuple[str, ...] = ()
    scale: float = (
        0.0  # how far the scale of such an instrument is usually off, as a factor; 0: its readings are lengths
    )
    placed: bool = False  # whether its own numbers are found with its frame, as the sizes of a pixel are
    # Whether all that is read at one configuration is one view (an image): wrong together, and left out together.
    views: bool = False
    # Symbols of its own numbers that one factor changes together: a focal length, the size of an image.
    factors: tuple[tuple[str, ...], ...] = ()
    owner: str = ""  # the option, and the key in a data file, that names the owner of the kind's own numbers


class Kinds(Mapping[str, Kind]):
    """Kinds by name: those of this package, whose modules are loaded when they are met, and whatever else was registered."""

    def __init__(self) -> None:
        self._met: dict[str, Kind] = {}

    def enter(self, kind: Kind) -> None:
        """Makes a kind known under its name."""
        self._met[kind.name] = kind

    def __getitem__(self, name: str) -> Kind:
        if name not in self._met and name in NAMES:
            import_module(f"robocal.measure.{name}")
        return self._met[name]

    def __contains__(self, name: object) -> bool:
        return name in NAMES or name in self._met

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys((*NAMES, *self._met)))

    def __len__(self) -> int:
        return len({*NAMES, *self._met})


KINDS: Kinds = Kinds()


def register(kind: Kind) -> Kind:
    """Makes a kind known under its name; one line at the end of its file, and one in `measure/kinds.py`."""
    KINDS.enter(kind)
    return kind


def scale_of(obs: Observations) -> float:
    """The standard deviation of the factor by which some observations may read all lengths too long: as stated, else as usual."""
    return kind_of(obs).scale if obs.scale is None else obs.scale


def kind_of(obs: Observations) -> Kind:
    """The kind of some observations. Raises ModelError for an unknown name."""
    return look_up(KINDS, obs.kind, "unknown kind of measurement")
