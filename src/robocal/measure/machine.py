"""What an identification asks of a machine, whatever it is; and the machine that has no joints.

    T_base_tool = elements(theta, phi(q)) * pose,    q joint values, pose the configuration's own

A serial arm is a path of elements driven by joint values. A cable platform, or a camera in the hand before a
board, has a pose of its own at every configuration: free in some components (found by the fit, a local block each), or in
none (known beforehand). Nothing above asks which of them it has.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robocal.geometry.path.joints import Joint, Zero
from robocal.geometry.path.program import Element, Program
from robocal.geometry.path.unjointed import Unjointed
from robocal.parameters import Table
from robocal.remarks.remark import Remark

__all__ = ["Machine", "Rig"]

Array = NDArray[np.float64]


class Machine(Protocol):
    """A model with named parameters, and where the frame that it carries is."""

    @property
    def name(self) -> str:
        """What people call it."""

    @property
    def table(self) -> Table:
        """Its parameters, in SI."""

    def with_values(self, values: Mapping[str, float], /) -> Self:
        """The same machine with other parameter values."""

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
    def geometric(self) -> tuple[str, ...]:
        """The parameters that its making leaves."""

    @property
    def lengths(self) -> tuple[str, ...]:
        """Those that are lengths of the machine and share its scale; a coordinate is none."""

    @property
    def anywhere(self) -> frozenset[str]:
        """Geometric parameters that may be anything: how far they change says nothing of its making."""

    @property
    def open_zeros(self) -> tuple[Zero, ...]:
        """The zeros of the joints that an identification may move."""

    @property
    def motions(self) -> Mapping[str, Mapping[str, float]]:
        """Motions of the frames in which it is told, by their common names, as rates of its parameters: its own sensors need not
        see them."""

    def remarks(self) -> tuple[Remark, ...]:
        """What its geometry shows before anything is measured."""


@dataclass(frozen=True)
class Rig(Unjointed):
    """A machine without joints: a pose of its own at every configuration, free in the components of `freedom`, and a table
    of whatever else belongs to it."""

    name: str = "rig"
    table: Table = field(default_factory=Table)
    freedom: tuple[int, ...] = (0, 1, 2, 3, 4, 5)
    geometric: tuple[str, ...] = ()
    lengths: tuple[str, ...] = ()

    def with_values(self, values: Mapping[str, float]) -> Self:
        """The same rig with other values."""
        return replace(self, table=self.table.with_values(values))
