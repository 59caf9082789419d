"""Kinds that touch: a point, a plane, a sphere.

Point constraint: r = p_ball(q) - p_place - y, in the axes of the base.

value y (k, 3) in m, normally 0, sigma (k, 3): how well the ball sits. A ball on the tool rests in one socket, or a
pointer touches one point, from many configurations; no instrument is needed. `options["place"]` is the socket as a
frame on the base (its x y z are seen), the target the ball (default: the tool's origin). One socket leaves the scale of
the arm open up to its known link lengths, and its orientation is never seen; two sockets a known distance apart (one
row of `distance`) fix the scale.
Source: Meggiolaro, Scriffignano and Dubowsky, Manipulator calibration using a single endpoint contact constraint (2000).

Contact with a plane: r = n . R_place^T (p - p_place) - offset - radius - y.

value y (k, 1) in m, normally 0, sigma (k, 1). A ball, probe or pointer on the tool touches a plate. `options["place"]`
is a frame on the base that carries the plane: z = 0 by default, of which one shift and two turns are seen (z rx ry of
a table, x or y of a wall); `extra["normal"]` (k, 3) and `extra["offset"]` (k,) in m name other planes of the same body
(the faces of a datum cube, of which all six are seen).
`options["radius"]` names the ball, whose parameter `NAME.radius` (m) is held or free; a single plane cannot tell it
from its own height. Several plates are several places. Readings of zero do not say from which side a plate is touched:
its frame may come out turned over. A single plane leaves a good part of the arm unseen; three that are not parallel see
nearly as much as positions do.
Source: Ikits and Hollerbach, Kinematic calibration using a plane constraint (1997); Zhuang, Motaghedi and Roth, Robot
calibration with planar constraints (1999).

Touch on a sphere: r = |p_tip - p_place| - (R + y).

value y (k, 1) in m, normally 0, sigma (k, 1). A probe on the tool touches a sphere on the base from many sides.
`options["place"]` is the sphere's centre as a frame on the base, the target the centre of the stylus ball (default: the
tool's origin); `options["radius"]` names the pair, and its parameter `NAME.radius` R (m) is the radius of the sphere
plus that of the stylus. A known R gives the scale; the orientation of the place is never seen.
The residual is that of a ballbar whose length is R (see `distance`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array, Ints
from robocal.errors import ModelError
from robocal.measure.builder import Builder, places_of
from robocal.measure.carriers import Inverse, Product
from robocal.measure.data import Observations
from robocal.measure.distance import DistanceRows
from robocal.measure.pose import DisplacementRows
from robocal.measure.rows import METRES, Carriers, Kind, Number, Rows, numbers, per_target, register
from robocal.parameters import Parameter

__all__ = ["PLANE", "POINT", "SPHERE", "normals"]

# --- point ------------------------------------------------------------------------------------------------------------

# The vector from the place to the ball, as that between two places of one target.
POINT = register(Kind("point", 3, per_target(DisplacementRows, Builder.between), frames=places_of, contact=True))


# --- plane ------------------------------------------------------------------------------------------------------------


def normals(obs: Observations) -> tuple[Array, Array]:
    """Unit normals (k, 3) and offsets (k,) in the place's frame. Raises ModelError for a normal without a length."""
    n = np.asarray(obs.extra.get("normal", np.tile([0.0, 0.0, 1.0], (len(obs), 1))), float)
    length = np.linalg.norm(n, axis=1, keepdims=True)
    if not (length > 0).all():
        raise ModelError("a normal needs a length", key=obs.label, found=n[int(np.argmin(length))].tolist())
    return n / length, np.asarray(obs.extra.get("offset", np.zeros(len(obs))), float)


class PlaneRows(Rows):
    """Height above the plane minus the ball's radius."""

    def __init__(self, carrier: Carriers, obs: Observations, index: Ints, numbers: Ints) -> None:
        super().__init__(carrier, obs, index, numbers)
        normal, offset = normals(obs)
        self.normal, self.offset = np.ascontiguousarray(normal[index]), offset[index]

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        t, j, jl = self.carrier.pose(x, first, rows, turn=False)
        n = self.normal[first : first + rows]
        height = np.einsum("mi,bmi->bm", n, t[:, :, :3, 3]) - self.offset[first : first + rows]
        r = height[..., None] - x[:, self.numbers].sum(axis=1)[:, None, None] - self.values_at(which, first, rows)
        own = np.full((*t.shape[:2], 1, len(self.own)), -1.0)
        return r, np.concatenate([n[:, None] @ j, own], axis=3), n[:, None] @ jl


def in_place(builder: Builder, obs: Observations, target: int, index: Ints) -> Product:
    """T_place_target."""
    place, ball = builder.between(obs, target, index)
    return Product(Inverse(place), ball)


BALL = (Number("radius", "radius", expected=0.01),)
OF_PLANE = per_target(PlaneRows, in_place)
PLANE = register(Kind("plane", 1, OF_PLANE, parts=METRES, frames=places_of, contact=True, owner="radius", numbers=BALL))


# --- sphere -----------------------------------------------------------------------------------------------------------

PAIR = (Number("radius", "radius", value=0.01, expected=0.01),)


def parameters(obs: Observations) -> Sequence[Parameter]:
    """The radius. Raises ModelError when it has no name."""
    if not obs.options.get("radius"):
        raise ModelError("a sphere needs a radius", key=obs.label, expected="the name of a radius")
    return numbers(obs, PAIR)


OF_SPHERE = per_target(DistanceRows, Builder.between)
SPHERE = register(
    Kind("sphere", 1, OF_SPHERE, parameters, METRES, frames=places_of, contact=True, owner="radius", numbers=PAIR)
)
