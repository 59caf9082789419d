"""What views of a flat target say of a lens before anything is fitted: homographies, the focal length, and the side that was seen.

    H = K [r1 r2 t],   W = diag(1 / f^2, 1 / f^2, 1) about the middle of the image:   h1' W h2 = 0,   h1' W h1 = h2' W h2

Both are linear in 1 / f^2, so that all views together give it in closed form. Source: Zhang, A flexible new technique for camera
calibration (2000), with square pixels and the principal point in the middle.
"""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array, Bools, Ints

__all__ = ["FlatViews", "find_focal", "flat_places", "flat_poses", "look_flat"]

FLAT = 1e-3  # tolerance: of the target's size, that it may stand out of a plane
WIDEST, LONGEST = 0.15, 30.0  # widths of an image: focal lengths beyond which no closed form is believed


@record(eq=False)
class FlatViews:
    """Homographies (S, 3, 3) from places on a target (m) to pixels, of each sight of one target in one `view` (S,), positive in front of
    the camera; the root of the mean square (S,) that each leaves, and the extent of its pixels about their middle, (px); NaN where a sight
    has less than four points; and whether each shows the side that z points out of (x right, y up, v down)."""

    view: Ints
    homography: Array
    left: Array
    extent: Array
    front: Bools

    @property
    def known(self) -> Bools:
        """Which sights have a homography, (S,)."""
        return np.isfinite(self.left)


def flat_places(points: Array) -> Array | None:
    """Places (n, 2) on the plane of points (n, 3), with the side kept that z points to; None where they do not lie in a plane."""
    centre = points.mean(axis=0)
    size, axes = np.linalg.svd(points - centre, full_matrices=False)[1:]
    if size[0] == 0 or size[2] > FLAT * size[0]:
        return None
    if np.ptp(points[:, 2]) <= FLAT * size[0]:
        return np.asarray(points[:, :2])
    axes[1] *= np.sign(np.cross(axes[0], axes[1])[2]) or 1.0
    return np.asarray((points - centre) @ axes[:2].T)


def look_flat(places: Array, pixels: Array, where: Ints, target: Ints) -> FlatViews:
    """Homographies from places (n, 2), pixels (n, 2), and the view and target (n,) of each, by the direct linear transform."""
    sights, view = np.unique(np.stack([where, target]), axis=1, return_inverse=True)
    view, count = view.ravel(), sights.shape[1]
    many = np.bincount(view, minlength=count)
    some = np.maximum(many, 1)

    def total(each: Array) -> Array:
        flat = each.reshape(len(each), -1)
        sums = [np.bincount(view, f, minlength=count) for f in flat.T]
        return np.stack(sums, axis=1).astype(float).reshape(count, *each.shape[1:])

    def centred(x: Array) -> tuple[Array, Array]:
        middle = total(x) / some[:, None]
        spread = np.sqrt(total((x - middle[view]) ** 2).sum(axis=1) / (2 * some))
        spread = np.where(spread > 0, spread, 1.0)
        to = np.zeros((count, 3, 3))
        to[:, 0, 0] = to[:, 1, 1] = 1 / spread
        to[:, :2, 2] = -middle / spread[:, None]
        to[:, 2, 2] = 1.0
        return (x - middle[view]) / spread[view, None], to

    (p, of_place), (q, of_pixel) = centred(places), centred(pixels)
    one, none = np.ones((len(p), 1)), np.zeros((len(p), 3))
    p1 = np.concatenate([p, one], axis=1)
    rows = [np.concatenate([p1, none, -q[:, :1] * p1], axis=1), np.concatenate([none, p1, -q[:, 1:] * p1], axis=1)]
    square = sum((total(r[:, :, None] * r[:, None, :]) for r in rows), np.zeros((count, 9, 9)))
    h = np.linalg.eigh(square)[1][:, :, 0].reshape(-1, 3, 3)
    # The middle of what was seen lies in front of the camera.
    h *= np.where(h[:, 2, 2] < 0, -1.0, 1.0)[:, None, None]
    seen = np.einsum("nij,nj->ni", h[view], p1)
    off = (q - seen[:, :2] / seen[:, 2:]) / of_pixel[view, 0, 0][:, None]
    left = np.sqrt(total((off**2).sum(axis=1)) / some)
    h = np.linalg.inv(of_pixel) @ h @ of_place
    lacking = many < 4
    h[lacking], left[lacking] = np.nan, np.nan
    # The nearest affine map has the side of the perspective, and of a wide lens too.
    front = np.linalg.det(total(q[:, :, None] * p[:, None, :])) < 0
    return FlatViews(sights[0], h, left, 1 / of_pixel[:, 0, 0], np.asarray(front))


def find_focal(seen: FlatViews, size: tuple[int, int]) -> float | None:
    """The focal length (px) of a camera whose images have a width and a height; None where views do not tell it, as frontal ones."""
    h = seen.homography[np.isfinite(seen.homography).all(axis=(1, 2))].copy()
    width, height = size
    h[:, 0] -= (width - 1) / 2 * h[:, 2]
    h[:, 1] -= (height - 1) / 2 * h[:, 2]
    a, b = h[:, :, 0], h[:, :, 1]
    length = (a[:, :2] ** 2 + b[:, :2] ** 2).sum(axis=1)
    near = [(a[:, :2] * b[:, :2]).sum(axis=1), (a[:, :2] ** 2 - b[:, :2] ** 2).sum(axis=1) / 2]
    far = [a[:, 2] * b[:, 2], (a[:, 2] ** 2 - b[:, 2] ** 2) / 2]
    p, q = (np.concatenate(parts) / np.tile(length, 2) for parts in (near, far))
    square = -float(p @ p) / float(p @ q) if p @ q < 0 else np.inf
    f = float(np.sqrt(square))
    return f if WIDEST * width < f < LONGEST * width else None


def flat_poses(seen: FlatViews, intrinsics: Array) -> Array:
    """T_camera_target (s, 4, 4) of the views that have a homography, through a lens whose distortion is left out."""
    h = seen.homography[np.isfinite(seen.homography).all(axis=(1, 2))].copy()
    fx, fy, cx, cy = intrinsics[:4]
    h[:, 0], h[:, 1] = (h[:, 0] - cx * h[:, 2]) / fx, (h[:, 1] - cy * h[:, 2]) / fy
    h /= np.linalg.norm(h[:, :, :2], axis=1).mean(axis=1)[:, None, None]
    out = np.tile(np.eye(4), (len(h), 1, 1))
    turn = np.stack([h[:, :, 0], h[:, :, 1], np.cross(h[:, :, 0], h[:, :, 1])], axis=2)
    u, _, vt = np.linalg.svd(turn)
    out[:, :3, :3], out[:, :3, 3] = u @ vt, h[:, :, 2]
    return out
