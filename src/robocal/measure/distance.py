"""Distance between two frames of the instrument's world: r = |p_a - p_b| - d.

value (k, 1) in m. The two ends are named frames (`options["ends"]`, two frames mounted on "base"): two sockets a
known distance apart, two reflectors on a bar. Ends that an arm carries come with the ballbar.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from robocal.arms.chain import frame_element
from robocal.errors import ModelError
from robocal.measure.base import Builder, Kind, Rows, register
from robocal.measure.carriers import Carrier, Inverse, Product
from robocal.measure.data import Frame, Observations
from robocal.parameters import Parameter

__all__ = ["DISTANCE"]

Array = NDArray[np.float64]
UNSTATED = (1e-4,)


class DistanceRows(Rows):
    """|p| of the relative frame; its gradient is the unit vector along it."""

    def evaluate(self, x: Array, which: NDArray[np.int64], first: int, rows: int) -> tuple[Array, Array, Array]:
        t, j, jl = self.carrier.pose(x, first, rows, turn=False)
        p = t[:, :, :3, 3]
        length = np.linalg.norm(p, axis=-1, keepdims=True)
        # Two frames in one place have no direction yet; the other measurements part them.
        along = (p / np.where(length > 0, length, 1.0))[:, :, None, :]
        return length - self.measured(which, first, rows), along @ j, along @ jl


def ends(obs: Observations) -> Sequence[Frame]:
    """The two frames. Raises ModelError when there are not two."""
    found = obs.options.get("ends", ())
    if not isinstance(found, tuple) or len(found) != 2:
        raise ModelError("a distance needs two ends", found=found, expected="two frames")
    return found


def terms(builder: Builder, obs: Observations) -> list[Rows]:
    """One term."""
    index = np.arange(len(obs))
    a, b = (builder.path([frame_element(end.name)], obs.configuration) for end in ends(obs))
    carrier: Carrier = Product(Inverse(a), b)
    return [DistanceRows(carrier, obs, index, UNSTATED)]


def parameters(obs: Observations) -> Sequence[Parameter]:
    """The two frames' rows."""
    return [p for end in ends(obs) for p in end.parameters]


DISTANCE = register(Kind("distance", 1, terms, parameters, ((0, 1, "m"),)))
