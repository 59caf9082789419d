"""Point constraint: r = p_ball(q) - p_place - y, in the axes of the base.

value y (k, 3) in m, normally 0, sigma (k, 3): how well the ball sits. A ball on the tool rests in one socket, or a
pointer touches one point, from many configurations; no instrument is needed. `options["place"]` is the socket as a
frame on the base (its x y z are seen), the target the ball (default: the tool's origin). One socket leaves the scale of
the arm open up to its known link lengths, and its orientation is never seen; two sockets a known distance apart (one
row of `distance`) fix the scale.
Source: Meggiolaro, Scriffignano and Dubowsky, Manipulator calibration using a single endpoint contact constraint (2000).
"""

from __future__ import annotations

from robocal.measure.builder import Builder, places_of
from robocal.measure.displacement import DisplacementRows
from robocal.measure.rows import Kind, per_target, register

__all__ = ["POINT"]

# The vector from the place to the ball, as that between two places of one target.
ROWS = per_target(DisplacementRows, Builder.between)
POINT = register(Kind("point", 3, ROWS, frames=places_of, contact=True))
