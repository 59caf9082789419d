"""Contact with a plane: r = n . R_place^T (p - p_place) - offset - radius - y.

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
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Ints
from robocal.errors import ModelError
from robocal.measure.builder import Builder, places_of
from robocal.measure.carriers import Inverse, Product
from robocal.measure.data import Observations
from robocal.measure.rows import METRES, Carriers, Kind, Number, Rows, per_target, register

__all__ = ["PLANE", "normals"]


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


NUMBERS = (Number("radius", "radius", expected=0.01),)
ROWS = per_target(PlaneRows, in_place)
PLANE = register(Kind("plane", 1, ROWS, parts=METRES, frames=places_of, contact=True, owner="radius", numbers=NUMBERS))
