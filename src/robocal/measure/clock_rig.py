"""A machine whose pose is known along a path, seen by an instrument whose clock differs from that of the machine.

    T_base_tool(t - delay) = trans(-v d) rot(-w d) T_i,    d = delay - delay_0

T_i is the pose where the path stands at t - delay_0, (v, w) its twist there in base coordinates, as columns of the configurations.
The change d is a parameter like any other; whoever moves the poses along the path until it is nothing has the delay exactly.
Of a target of unknown size the same rig has its lengths in those of the target: p_i (1 + e), a target 1 / (1 + e) times as large as stated.
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

__all__ = ["ClockRig", "clock_rig", "place_columns", "rate_columns"]

EXPECTED = 0.02  # s, between two clocks on one network
AXES = ("tx", "ty", "tz", "rx", "ry", "rz")
RATES = tuple(f"rate.{axis}" for axis in AXES)
PRINTED = 0.01  # of a printed target
PLACES = tuple(f"place.{axis}" for axis in AXES[:3])


@record
class ClockRig(Rig):
    """A rig at known poses on its way, and the elements by which its delay, or the size of what it sees, moves them."""

    freedom: tuple[int, ...] = ()
    elements: tuple[Element, ...] = ()

    def phi(
        self, joints: ArrayLike, extra: Mapping[str, ArrayLike] | None = None, program: Program | None = None, /
    ) -> Array:
        """The rates of the configurations, in the order in which a program asks for them."""
        terms = [t.column for e in self.elements for t in e.terms]
        names = terms if program is None else program.columns
        return np.column_stack([np.asarray((extra or {})[n], dtype=float) for n in names])


def clock_rig(instrument: str, target: str = "", *, delay: bool = True) -> ClockRig:
    """The rig that an instrument sees; free is its parameter `instrument.delay` (s), and `target.shrink` (e) of a target."""
    table: list[Parameter] = []
    elements: list[Element] = []
    if target:
        name = f"{target}.shrink"
        table.append(Parameter(name, 0.0, "1", True, expected=PRINTED))
        elements += [Element(axis, (Term(name, place),)) for axis, place in zip(AXES[:3], PLACES, strict=True)]
    if delay:
        name = f"{instrument}.delay"
        table.append(Parameter(name, 0.0, "s", True, expected=EXPECTED))
        elements += [Element(axis, (Term(name, rate),)) for axis, rate in zip(AXES, RATES, strict=True)]
    return ClockRig(instrument, ParameterTable(tuple(table)), elements=tuple(elements))


def place_columns(place: Array) -> Mapping[str, Array]:
    """The columns of configurations whose tool is at (m, 3) in base coordinates, m."""
    return dict(zip(PLACES, np.asarray(place).T, strict=True))


def rate_columns(twist: Array) -> Mapping[str, Array]:
    """The columns of configurations whose tool moves by twist (m, 6) in base coordinates, (m/s, rad/s): a reading that came later
    belongs to where it was before."""
    return {name: -values for name, values in zip(RATES, np.asarray(twist).T, strict=True)}
