"""Position of a point: r = p(theta) - y, in the coordinates of the instrument.

value (k, 3) and sigma (k, 3) in m. A laser tracker with a reflector, a stereo camera with a ball; with value zero in
a frame that may only shift it is a ball that rests in one socket.
"""

from __future__ import annotations

from robocal._types import Array, Ints
from robocal.measure.rows import Kind, Rows, per_target, register

__all__ = ["POSITION"]


class PositionRows(Rows):
    """Residual p - y; the Jacobian is the upper half of the carrier's."""

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        t, j, jl = self.carriers[0].pose(x, first, rows, False)
        return t[:, :, :3, 3] - self.values_at(which, first, rows), j, jl


POSITION = register(Kind("position", 3, per_target(PositionRows), positional=True, metric=True))
