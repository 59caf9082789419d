"""Position of a point: r = p(theta) - y, in the coordinates of the instrument.

value (k, 3) and sigma (k, 3) in m. A laser tracker with a reflector, a stereo camera with a ball; with value zero in
a frame that may only shift it is a ball that rests in one socket.
"""

from __future__ import annotations

from robocal._types import Array, Ints
from robocal.measure.builder import Builder
from robocal.measure.data import Observations
from robocal.measure.rows import Kind, Rows, register

__all__ = ["POSITION"]

# Until the residuals tell better: one tenth of a millimetre.
UNSTATED = (1e-4,) * 3


class PositionRows(Rows):
    """Residual p - y; the Jacobian is the upper half of the carrier's."""

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        t, j, jl = self.carrier.pose(x, first, rows, turn=False)
        return t[:, :, :3, 3] - self.values_at(which, first, rows), j, jl


def terms(builder: Builder, obs: Observations) -> list[Rows]:
    """One term per target."""
    return [PositionRows(builder.view(obs, t, index), obs, index, UNSTATED) for t, index in builder.split(obs)]


POSITION = register(Kind("position", 3, terms, positional=True, metric=True))
