"""The way from a machine to carriers: a kind of measurement asks here where a frame is, and never sees a machine."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from robocal._record import record
from robocal._types import Array, Ints
from robocal.errors import ModelError
from robocal.geometry import se3
from robocal.geometry.path.program import Element, Program, compile_path, frame_element
from robocal.measure.carriers import Carrier, Gathered, Inverse, KnownPose, LocalPose, PathCarrier, Product
from robocal.measure.data import Configurations, Frame, Observations
from robocal.measure.machine import Mechanism, Model, freedom_of, joints_of
from robocal.parameters import ParameterTable

__all__ = ["OFFSET", "Builder", "gather", "offset_of", "offsets_of", "place_of", "places_of"]

OFFSET = "offset"  # the option of an instrument that sits on another frame: where on it


@record
class Builder:
    """Makes the carriers that kinds ask for."""

    machine: Model
    table: ParameterTable
    configurations: Configurations
    local_targets: tuple[str, ...] = ()  # targets that are local blocks
    target_axes: tuple[int, ...] = (0, 1, 2, 3, 4, 5)  # the components that are free of them
    nothing: frozenset[str] = frozenset()  # parameters that are zero and stay so: what they multiply is not asked for

    def rows(self, names: Iterable[str]) -> Ints:
        """The table rows of some parameters."""
        return np.array([self.table.index[self.machine.row(name)] for name in names], dtype=np.int64)

    def path(self, elements: Sequence[Element], configuration: Ints) -> PathCarrier:
        """A path of elements at some configurations."""
        program = compile_path(elements, self.table)
        if not program.columns:
            phi = np.zeros((1, len(configuration), 0))
            return PathCarrier(program, phi, program.cosines(phi))
        phi, trig = self._driven(program)
        if len(configuration) != phi.shape[1] or (configuration != np.arange(len(configuration))).any():
            phi, trig = (np.ascontiguousarray(a[:, configuration]) for a in (phi, trig))
        if np.isnan(phi).any():
            _, row, column = np.argwhere(np.isnan(phi))[0]
            place = self.configurations.ids[configuration[row]]
            message = "a configuration lacks a value that the model needs"
            raise ModelError(message, key=program.columns[column], found=place)
        return PathCarrier(program, phi, trig)

    @property
    def mechanism(self) -> Mechanism:
        """What moves. Raises ModelError for a model that has no place."""
        if self.machine.mechanism is None:
            raise ModelError("this measures where something is, and the model has no place", found=self.machine.name)
        return self.machine.mechanism

    def _driven(self, program: Program) -> tuple[Array, Array]:
        """What the configurations drive a program with, (1, U, C), and its cosines (1, U, D, 2): the same in every problem of
        one machine and its configurations."""
        c, what = self.configurations, (program.columns, *program.turning[0].tolist())
        known = c.memo.get("driven")
        if known is None or known[0] is not self.machine or known[1] != what:
            if c.joints is None and joints_of(self.machine):
                expected = ", ".join(j.name for j in joints_of(self.machine))
                raise ModelError("the model needs joint values that the data lack", expected=expected)
            joints = np.empty((len(c), 0)) if c.joints is None else c.joints
            phi = np.ascontiguousarray(self.mechanism.phi(joints, c.columns, program)[None])
            known = c.memo["driven"] = self.machine, what, phi, program.cosines(phi)
        return known[2], known[3]

    def tool(self, configuration: Ints, before: Sequence[Element] = (), after: Sequence[Element] = ()) -> Carrier:
        """The machine's tool or platform frame, with frames before and behind it."""
        moving = self.mechanism
        own_elements = [e.without(self.nothing) for e in moving.elements] if self.nothing else moving.elements
        first = (*before, *own_elements)
        if moving.freedom is None:
            return self.path((*first, *after), configuration)
        own: Carrier
        if moving.freedom:
            block, many = np.ascontiguousarray(configuration), len(self.configurations)
            own = LocalPose(block, len(self.table), many, moving.freedom)
        else:
            own = KnownPose(se3.from_vector(self.configurations.starts[configuration]))
        if first:
            own = Product(self.path(first, configuration), own)
        return Product(own, self.path(after, configuration)) if after else own

    def carrier_of(self, thing: Frame | None, configuration: Ints, block: Ints | None = None) -> Carrier:
        """T_base_thing of a frame that the tool carries (None: the tool itself) or that stands on the base; `block` are those of a
        target that is one of many local blocks."""
        if thing is None:
            return self.tool(configuration)
        if block is not None:
            own = self.local(block)
            return Product(self.tool(configuration), own) if thing.mount == "tool" else own
        after = [frame_element(thing.name)]
        return self.tool(configuration, after=after) if thing.mount == "tool" else self.path(after, configuration)

    def local(self, block: Ints) -> LocalPose:
        """The frames of targets that are local blocks, (m,): they come behind the poses, where these are free too."""
        second = bool(freedom_of(self.machine))
        at = len(self.table) + 6 * len(self.configurations) * second
        return LocalPose(block, at, len(self.local_targets), self.target_axes, int(second))

    def blocks(self, obs: Observations, target: int, index: Ints) -> Ints | None:
        """The local blocks of the targets of some rows, where the first of them is one."""
        if not obs.targets or obs.targets[target].name not in self.local_targets:
            return None
        number = {name: i for i, name in enumerate(self.local_targets)}
        of = np.array([number.get(t.name, -1) for t in obs.targets], dtype=np.int64)
        return of[index * 0 if obs.target is None else obs.target[index]]

    def target(self, obs: Observations, target: int, configuration: Ints, index: Ints) -> Carrier:
        """T_base_target of the targets of some rows, at any configurations."""
        thing = obs.targets[target] if obs.targets else None
        return self.carrier_of(thing, configuration, self.blocks(obs, target, index))

    def between(self, obs: Observations, target: int, index: Ints) -> tuple[Carrier, Carrier]:
        """The place on the base, and the target that is measured against it. Raises ModelError as `place_of`."""
        configuration = obs.configuration[index]
        return self.carrier_of(place_of(obs), configuration), self.target(obs, target, configuration, index)

    def second(self, obs: Observations, index: Ints) -> Ints:
        """The other configuration of rows that compare two. Raises ModelError when there is none."""
        if obs.second is None:
            expected = "a second configuration in every row"
            raise ModelError(f"{obs.kind} compares two configurations", key=obs.label, expected=expected)
        return np.ascontiguousarray(obs.second[index])

    def view(self, obs: Observations, target: int, index: Ints, *, second: bool = False) -> Carrier:
        """T_measuring_measured of some rows that share one target, or whose targets are local blocks; `second` looks at the other
        configuration."""
        configuration = self.second(obs, index) if second else obs.configuration[index]
        seen = obs.targets[target] if obs.targets else None
        block = self.blocks(obs, target, index)
        after = [frame_element(seen.name)] if seen and block is None else []
        carrier = self.sight(obs, seen, configuration, after)
        return carrier if block is None else Product(carrier, self.local(block))

    def sight(self, obs: Observations, seen: Frame | None, configuration: Ints, after: list[Element]) -> Carrier:
        """What `view` sees of `seen`, or of what carries it, with `after` behind it."""
        if obs.frame is None:
            return self.tool(configuration, after=after)
        own = instrument_elements(obs)
        if obs.frame.mount == "base":
            if seen is None or seen.mount == "tool":
                return self.tool(configuration, before=own, after=after)
            return self.path([*own, *after], configuration)
        sensor = gather(lambda where: Inverse(self.tool(where, after=own)), configuration)
        return Product(sensor, self.path(after, configuration)) if after else sensor

    def instrument(self, obs: Observations, configuration: Ints) -> Carrier | None:
        """T_base_instrument; None of one that tells base coordinates."""
        if obs.frame is None:
            return None
        own = instrument_elements(obs)
        return (
            self.tool(configuration, after=own) if obs.frame.mount == "tool" else Inverse(self.path(own, configuration))
        )

    def split(self, obs: Observations) -> list[tuple[int, Ints]]:
        """The rows of every target, so that each group is one path; those of targets that are local blocks are one group."""
        if obs.target is None:
            return [(0, np.arange(len(obs)))]
        if len(obs) and not 0 <= obs.target.min() <= obs.target.max() < len(obs.targets):
            expected = f"0 to {len(obs.targets) - 1}"
            raise ModelError("an observation of a target that is not listed", key=obs.label, expected=expected)
        local = [t for t, frame in enumerate(obs.targets) if frame.name in self.local_targets]
        groups = [[t] for t in range(len(obs.targets)) if t not in local] + ([local] if local else [])
        found = [(np.flatnonzero(np.isin(obs.target, group))) for group in groups]
        return [(int(obs.target[index[0]]), index) for index in found if len(index)]


def offset_of(obs: Observations) -> Frame | None:
    """Where on its frame the instrument sits, T_frame_instrument; None of one that is the frame itself. Raises ModelError of a frame on
    the base, which stores the other direction."""
    offset = obs.options.get(OFFSET)
    if offset is None:
        return None
    if not isinstance(offset, Frame) or obs.frame is None or obs.frame.mount != "tool":
        raise ModelError(
            "an offset without a frame on the tool", key=obs.label, expected="a frame that the tool carries"
        )
    return offset


def offsets_of(obs: Observations) -> tuple[Frame, ...]:
    """The frame of the offset, where there is one."""
    offset = offset_of(obs)
    return () if offset is None else (offset,)


def instrument_elements(obs: Observations) -> list[Element]:
    """The frame of an instrument, and where on it the instrument sits."""
    assert obs.frame is not None
    return [frame_element(f.name) for f in (obs.frame, *offsets_of(obs))]


def place_of(obs: Observations) -> Frame:
    """The place on the base that a kind measures against, stored as T_base_place. Raises ModelError when it is missing
    or not on the base."""
    place = obs.options.get("place")
    if not isinstance(place, Frame) or place.mount != "base":
        raise ModelError(f"{obs.kind} needs a place", key=obs.label, found=place, expected="a frame on the base")
    return place


def places_of(obs: Observations) -> tuple[Frame, ...]:
    """The frames of a kind that measures against one place on the base."""
    return (place_of(obs),)


def gather(make: Callable[[Ints], Carrier], configuration: Ints) -> Carrier:
    """The carrier of some rows (m,), computed once for each configuration where several rows share one."""
    where, which = np.unique(configuration, return_inverse=True)
    if 2 * len(where) > len(configuration):
        return make(configuration)
    return Gathered(make(where), np.ascontiguousarray(which.ravel()))
