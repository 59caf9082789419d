"""Points in the image plane of a probe, against wires: r = E^T (R S (u, v) + t - a) - y.

T_phantom_image = (R, t), S (u, v) = (s_u u, s_v v, 0). extra["image"] (k, 2) in pixels is where the wire was seen; extra["at"] (k, 3) in m
is a point a of it in the phantom's frame, extra["across"] (k, 2, 3) two unit vectors E across it. value y (k, 2) in m is normally 0.
`options["image"]` names the image, whose parameters `NAME.su` and `NAME.sv` (m) are the sizes of a pixel. The frame is the image's: x along
u, y along v, z away from the one who looks at x to the right and y down. Mounted on "tool" it is a probe that the machine moves.
Source: Pagoulatos, Haynor and Kim, A fast calibration method for 3-D tracking of ultrasound images using a spatial localizer (2001).
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Ints
from robocal.measure.builder import Builder
from robocal.measure.carriers import Inverse
from robocal.measure.data import Observations
from robocal.measure.rows import Carriers, Kind, Number, Rows, per_target, register

__all__ = ["ACROSS", "AT", "IMAGE", "NAMED", "NUMBERS", "PIXEL_SIZES", "PLANE_POINTS", "ROWS", "across"]

IMAGE, AT, ACROSS, NAMED = "image", "at", "across", "named"  # what rows have beside their value
PIXEL_SIZES = ("su", "sv")
NUMBERS = tuple(Number(IMAGE, s, value=1e-4, expected=1e-4) for s in PIXEL_SIZES)


def across(direction: Array) -> Array:
    """Two unit vectors (k, 2, 3) across directions (k, 3) and across each other."""
    d = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    least = np.eye(3)[np.abs(d).argmin(axis=1)]
    first = np.cross(d, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(d, first)], axis=1)


class ImagePointRows(Rows):
    """The distance vector of a point of the image from what it shows, in the directions that are observable."""

    def __init__(self, carrier: Carriers, obs: Observations, index: Ints, numbers: Ints) -> None:
        super().__init__(carrier, obs, index, numbers)
        self.image, self.at = obs.extra[IMAGE][index], obs.extra[AT][index]
        # Points have all three directions, and say none.
        given = obs.extra.get(ACROSS)
        self.across = np.broadcast_to(np.eye(3), (len(index), 3, 3)) if given is None else given[index]

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        t, j, jl = self.carrier.pose(x, first, rows)
        some = slice(first, first + rows)
        uv, e = self.image[some], self.across[some]
        r = t[:, :, :3, :3]
        # (B, m, 3, 2): how the point moves with the size of a pixel
        sizes = r[..., :2] * uv[:, None, :]
        lever = np.einsum("bmis,bs->bmi", sizes, x[:, self.numbers])
        left = np.einsum("mdi,bmi->bmd", e, lever + t[:, :, :3, 3] - self.at[some])
        own = e @ sizes[..., self.own]
        moved, local = (e @ _at(lever, jac) for jac in (j, jl))
        return left - self.values_at(which, first, rows), np.concatenate([moved, own], axis=3), local


def _at(lever: Array, jac: Array) -> Array:
    """v + w x lever (B, m, 3, k) of a twist (B, m, 6, k)."""
    return np.asarray(jac[:, :, :3] + np.cross(jac[:, :, 3:], lever[..., None], axis=2))


def in_phantom(builder: Builder, obs: Observations, target: int, index: Ints) -> Inverse:
    """T_phantom_image."""
    return Inverse(builder.view(obs, target, index))


ROWS = per_target(ImagePointRows, in_phantom)
PLANE_POINTS = register(
    Kind("plane_points", 2, ROWS, parts=((0, 2, "m"),), owner=IMAGE, numbers=NUMBERS, views=True, placed=True)
)
