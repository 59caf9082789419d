"""Markers that are laid out before anybody prints them, and what a camera will see of a map."""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array, Ints
from robocal.geometry import se3, so3
from robocal.vision.camera import fold_mask, image_of
from robocal.vision.maps import MarkerMap

__all__ = ["MapViews", "lay_out", "project_map"]

BORDER = 8.0  # px that a marker keeps from the rim of the image, for its white
SIDE = 20.0  # px, the least side of a marker that a search finds
FACING = np.cos(np.radians(65.0))  # of the angle under which a search still finds a marker
GOLDEN = np.pi * (3.0 - np.sqrt(5.0))  # rad: azimuths that repeat nowhere


def lay_out(columns: int, rows: int, field: tuple[float, float], size: float, height: float, tilt: float) -> MarkerMap:
    """A map of columns x rows markers of one size over a field (width, depth) about the origin, z up. Lengths in m, tilt in rad.

    Every second marker, as on a chessboard, is raised by `height`; each is tilted by `tilt`, about horizontal axes in all directions.
    """
    x, y = (
        np.linspace(-w / 2, w / 2, n) if n > 1 else np.zeros(1) for n, w in zip((columns, rows), field, strict=True)
    )
    at = np.array([(a, b, height * ((i + j) % 2)) for j, b in enumerate(y) for i, a in enumerate(x)])
    azimuth = GOLDEN * np.arange(len(at))
    turn = so3.exp(tilt * np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(len(at))], axis=1))
    names = tuple(str(i) for i in range(len(at)))
    return MarkerMap(names, np.full(len(at), size), se3.to_vector(se3.compose(turn, at)), source="laid out")


@record(eq=False)
class MapViews:
    """Markers that views show whole: view (k,), marker (k,), corners in the image (k, 4, 2) px."""

    view: Ints
    marker: Ints
    pixels: Array


def project_map(known: MarkerMap, cameras: Array, intrinsics: Array, size: tuple[int, int]) -> MapViews:
    """What cameras T_map_camera (V, 4, 4) see of a map through a lens (n,), in images of `size` (width, height) px.

    A marker counts where all its corners are in the image, 8 px from its rim, its side is 20 px or more (the root of its area), and it is
    seen from its printed side at no more than 65 degrees from its normal. Nothing hides anything.
    """
    inward = se3.inverse(cameras)
    corners = known.corners.reshape(-1, 3)
    there = np.einsum("vij,nj->vni", inward[:, :3, :3], corners) + inward[:, None, :3, 3]
    there = there.reshape(len(cameras), -1, 4, 3)
    middle = there.mean(axis=2)
    normal = np.einsum("vij,mj->vmi", inward[:, :3, :3], known.poses[:, :3, 2])
    facing = -np.sum(normal * middle, axis=-1) / np.maximum(np.linalg.norm(middle, axis=-1), 1e-12)
    before = (there[..., 2] > 1e-6).all(axis=-1) & (facing > FACING)  # tolerance: m, of a point in the camera
    out = np.full((*before.shape, 4, 2), np.nan)
    some = there[before].reshape(-1, 3)
    if len(some):
        flat = image_of(some, intrinsics)
        flat[fold_mask(some, intrinsics)] = np.nan
        out[before] = flat.reshape(-1, 4, 2)
    with np.errstate(invalid="ignore"):
        inside = ((out >= BORDER) & (out <= np.array(size) - 1 - BORDER)).all(axis=(-1, -2))
        one, other = out[..., 2, :] - out[..., 0, :], out[..., 3, :] - out[..., 1, :]
        area = np.abs(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]) / 2
        seen = before & inside & (area >= SIDE**2)
    view, marker = np.nonzero(seen)
    return MapViews(view, marker, out[seen])
