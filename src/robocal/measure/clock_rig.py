"""A machine whose pose is known along a path, seen by an instrument whose clock differs from that of the machine.

    T_base_tool(t - delay) = trans(-v d) rot(-w d) T_i,    d = delay - delay_0

T_i is the pose where the path stands at t - delay_0, (v, w) its twist there in base coordinates, as columns of the configurations.
The change d is a parameter like any other; whoever moves the poses along the path until it is nothing has the delay exactly.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import record
from robocal._types import Array
from robocal.geometry.path.program import Element, Program, Term
from robocal.measure.machine import Rig
from robocal.parameters import Parameter, ParameterTable

__all__ = ["clock_rig", "rate_columns"]

EXPECTED = 0.02  # s, between two clocks on one network
AXES = ("tx", "ty", "tz", "rx", "ry", "rz")
RATES = tuple(f"rate.{axis}" for axis in AXES)


@record
class ClockRig(Rig):
    """A rig at known poses on its way, and the elements by which its delay moves them."""

    freedom: tuple[int, ...] = ()
    elements: tuple[Element, ...] = ()

    def phi(
        self, joints: ArrayLike, extra: Mapping[str, ArrayLike] | None = None, program: Program | None = None, /
    ) -> Array:
        """The rates of the configurations, in the order in which a program asks for them."""
        names = RATES if program is None else program.columns
        return np.column_stack([np.asarray((extra or {})[n], dtype=float) for n in names])


def clock_rig(instrument: str) -> ClockRig:
    """The rig that an instrument sees; free is its parameter `instrument.delay` (s)."""
    delay = f"{instrument}.delay"
    table = ParameterTable((Parameter(delay, 0.0, "s", True, expected=EXPECTED),))
    elements = tuple(Element(axis, (Term(delay, rate),)) for axis, rate in zip(AXES, RATES, strict=True))
    return ClockRig(instrument, table, elements=elements)


def rate_columns(twist: Array) -> Mapping[str, Array]:
    """The columns of configurations whose tool moves by twist (m, 6) in base coordinates, (m/s, rad/s): a reading that came later
    belongs to where it was before."""
    return {name: -values for name, values in zip(RATES, np.asarray(twist).T, strict=True)}
