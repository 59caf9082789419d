"""What an identification asks of a model and of a mechanism, whatever they are; and the mechanism that has no joints.

    T_base_tool = elements(theta, phi(q)) * pose,    q joint values, pose the configuration's own

A serial arm is a path of elements driven by joint values. A cable platform, or a camera in the hand before a
board, has a pose of its own at every configuration: free in some components (found by the fit, a local block each), or in
none (known beforehand). Nothing above asks which of them it has.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, Self, TypeVar, cast

from numpy.typing import ArrayLike

from robocal._record import field, record, replace
from robocal._types import Array
from robocal.geometry.path.program import Element, Joint, Program, Zero
from robocal.geometry.path.unjointed import Unjointed
from robocal.parameters import ParameterTable
from robocal.remarks.remark import Remark

__all__ = ["Mechanism", "Model", "Rig", "find_poses", "freedom_of", "joints_of", "sensor_zeros"]

P = TypeVar("P")


class Model(Protocol):
    """A thing with named parameters that are to be found: a motor, a camera, a map of markers, or a mechanism."""

    @property
    def name(self) -> str:
        """What people call it."""

    @property
    def table(self) -> ParameterTable:
        """Its parameters, in SI."""

    def row(self, name: str, /) -> str:
        """The parameter of the table that stands for a name: its own, or the one that it shares with another part."""

    def with_values(self, values: Mapping[str, float], /) -> Self:
        """The same model with other parameter values."""

    def with_table(self, table: ParameterTable, /) -> Self:
        """The same model with another table of the same names."""

    @property
    def geometric(self) -> tuple[str, ...]:
        """The parameters that its making leaves."""

    @property
    def lengths(self) -> tuple[str, ...]:
        """Those that are lengths of the machine and share its scale; a coordinate is none."""

    @property
    def anywhere(self) -> frozenset[str]:
        """Parameters that may be anything, geometric ones and zeros: how far they change says nothing of its making."""

    @property
    def parts(self) -> Mapping[str, tuple[str, ...]]:
        """The names of its parts by the word for them: joint, cable, ...; the first is what its size is told in."""

    def part(self, kind: type[P], /) -> P | None:
        """What of it is of this kind: itself or one of its parts; None where it has none."""

    @property
    def mechanism(self) -> Mechanism | None:
        """The same where it moves; None where it has no place."""


class Mechanism(Model, Protocol):
    """A model that says where the frame that it carries is."""

    @property
    def elements(self) -> tuple[Element, ...]:
        """From the base to what moves."""

    @property
    def joints(self) -> tuple[Joint, ...]:
        """What drives the elements; none where every configuration has a pose of its own."""

    @property
    def freedom(self) -> tuple[int, ...] | None:
        """The components (x y z rx ry rz) of a configuration's own pose that a fit may move; the others stay where the
        configuration starts. None: there is no such pose."""

    def phi(
        self, joints: ArrayLike, extra: Mapping[str, ArrayLike] | None = None, program: Program | None = None, /
    ) -> Array:
        """The columns (m, C) that a program reads, from joint values (m, n) and what else was recorded."""

    @property
    def open_zeros(self) -> tuple[Zero, ...]:
        """The zeros of the joints that an identification may move."""

    @property
    def gravity(self) -> tuple[float, float, float]:
        """The acceleration of gravity in base coordinates (m/s^2)."""

    @property
    def frame_points(self) -> Array:
        """Points (m, 3) of the frame between which it moves, in base coordinates; none where joints carry it."""

    def lines(
        self, joints: Array | None, poses: Array, extra: Mapping[str, ArrayLike] | None = None, /
    ) -> Mapping[str, Array]:
        """What a picture shows of it, by name: the points (m, k, 3) of one line at joint values (m, n), with what it carries at
        poses (m, 4, 4), in base coordinates (m)."""

    @property
    def motions(self) -> Mapping[str, Mapping[str, float]]:
        """Motions of the frames in which it is described, by their common names, as rates of its parameters: its own sensors need
        not observe them."""

    def remarks(self) -> tuple[Remark, ...]:
        """What its geometry shows before anything is measured."""


def freedom_of(model: Model) -> tuple[int, ...] | None:
    """The freedom of a configuration's own pose; None where there is no such pose, or nothing moves."""
    return None if model.mechanism is None else model.mechanism.freedom


def sensor_zeros(model: Model) -> tuple[str, ...]:
    """The lengths from which the sensors of a machine with poses of its own count: its making does not leave them."""
    if freedom_of(model) is None:
        return ()
    return tuple(p.name for p in model.table.rows if p.unit == "m" and p.name not in model.geometric)


def joints_of(model: Model) -> tuple[Joint, ...]:
    """The joints; none where nothing is driven."""
    return () if model.mechanism is None else model.mechanism.joints


@record
class Rig(Unjointed):
    """A machine without joints: a pose of its own at every configuration, free in the components of `freedom`, and a table
    of whatever else belongs to it."""

    name: str = "rig"
    table: ParameterTable = field(default_factory=ParameterTable)
    freedom: tuple[int, ...] = (0, 1, 2, 3, 4, 5)
    geometric: tuple[str, ...] = ()
    lengths: tuple[str, ...] = ()

    def with_values(self, values: Mapping[str, float]) -> Self:
        """The same rig with other values."""
        return self.with_table(self.table.with_values(values))

    def with_table(self, table: ParameterTable) -> Self:
        """The same rig with another table."""
        return replace(self, table=table)


def find_poses(model: Model) -> Model:
    """A machine whose poses are known, as one whose poses are to be found."""
    made: Model = replace(cast("Any", model), freedom=Rig.freedom)
    return made
