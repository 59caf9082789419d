"""What machines of one mechanism have in common, and those without joints: nothing is driven, so there is no path to speak of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Self, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robocal.geometry.gravity import GRAVITY
from robocal.geometry.path.program import Element, Joint, Program, Zero
from robocal.remarks.remark import Remark

__all__ = ["Unjointed", "Whole"]

P = TypeVar("P")
Floats: TypeAlias = NDArray[np.float64]


class Whole:
    """A machine that is one mechanism, whose parameters have their own names alone."""

    @property
    def mechanism(self) -> Self:
        """Itself: it moves."""
        return self

    def part(self, kind: type[P], /) -> P | None:
        """Itself, where it is of this kind."""
        return self if isinstance(self, kind) else None

    def row(self, name: str, /) -> str:
        """The parameter that stands for a name: its own."""
        return name

    @property
    def motions(self) -> Mapping[str, Mapping[str, float]]:
        """Motions of its frames: none."""
        return {}

    @property
    def gravity(self) -> tuple[float, float, float]:
        """Standard gravity, z up."""
        return GRAVITY

    @property
    def frame_points(self) -> Floats:
        """Points (m, 3) of the frame between which it moves: none."""
        return np.empty((0, 3))

    def lines(
        self, joints: Floats | None, poses: Floats, extra: Mapping[str, ArrayLike] | None = None, /
    ) -> Mapping[str, Floats]:
        """What a picture shows of it: nothing."""
        return {}


class Unjointed(Whole):
    """A machine whose configurations have poses of their own: no elements, no joints, no columns."""

    elements: tuple[Element, ...] = ()  # from the base to what moves
    joints: tuple[Joint, ...] = ()  # what drives the elements
    open_zeros: tuple[Zero, ...] = ()  # of joints

    @property
    def anywhere(self) -> frozenset[str]:
        """Parameters that may be anything: none."""
        return frozenset()

    @property
    def parts(self) -> Mapping[str, tuple[str, ...]]:
        """The names of its parts: none has one."""
        return {}

    def phi(
        self, joints: ArrayLike, extra: Mapping[str, ArrayLike] | None = None, program: Program | None = None, /
    ) -> Floats:
        """The columns that a program reads: none."""
        return np.empty((len(np.atleast_2d(np.asarray(joints))), 0))

    def remarks(self) -> tuple[Remark, ...]:
        """What the geometry shows before anything is measured: nothing."""
        return ()
