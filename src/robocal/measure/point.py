"""Point constraint: r = p_ball(q) - p_place - y, in the axes of the base.

value y (k, 3) in m, normally 0, sigma (k, 3): how well the ball sits. A ball on the tool rests in one socket, or a
pointer touches one point, from many configurations; no instrument is needed. `options["place"]` is the socket as a
frame on the base (its x y z are seen), the target the ball (default: the tool's origin). One socket leaves the scale of
the arm open up to its known link lengths, and its orientation is never seen; two sockets a known distance apart (one
row of `distance`) fix the scale.
Source: Meggiolaro, Scriffignano and Dubowsky, Manipulator calibration using a single endpoint contact constraint (2000).
"""

from __future__ import annotations

from robocal._types import Array, Ints
from robocal.measure.builder import Builder
from robocal.measure.data import Observations
from robocal.measure.rows import Between, Kind, Rows, place_of, places_of, register

__all__ = ["POINT"]

UNSTATED = (1e-4,) * 3


class PointRows(Between):
    """The vector from the place to the ball."""

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        d, j, jl = self.gap(x, first, rows)
        return d - self.values_at(which, first, rows), j, jl


def terms(builder: Builder, obs: Observations) -> list[Rows]:
    """One term per target."""
    return [PointRows(builder.between(place_of(obs), obs, t, i), obs, i, UNSTATED) for t, i in builder.split(obs)]


POINT = register(Kind("point", 3, terms, frames=places_of, contact=True))
