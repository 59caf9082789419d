"""Displacement between two configurations: r = R_frame_base (p(second) - p(first)) - y.

value (k, 3) and sigma (k, 3) in m, in the axes of the instrument's frame (without one: of the base); only its rotation
is seen. An instrument that was moved between runs, a 3D camera or a laser that reports changes: where it stands cancels.
Noise is that of the difference: twice the variance of one reading, and rows that share a configuration share its error.
"""

from __future__ import annotations

from robocal._types import Array, Ints
from robocal.measure.builder import Builder
from robocal.measure.carriers import Carrier
from robocal.measure.data import Observations
from robocal.measure.rows import Between, Kind, per_target, register

__all__ = ["DISPLACEMENT"]


class DisplacementRows(Between):
    """The vector between two places: of the target, seen from one instrument."""

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        d, j, jl = self.gap(x, first, rows)
        return d - self.values_at(which, first, rows), j, jl


def views(builder: Builder, obs: Observations, target: int, index: Ints) -> tuple[Carrier, Carrier]:
    """The target at both configurations, as the instrument sees it."""
    return builder.view(obs, target, index), builder.view(obs, target, index, second=True)


DISPLACEMENT = register(Kind("displacement", 3, per_target(DisplacementRows, views), metric=True))
