"""What a lens does to the pixels of a marker: known, it is undone; unknown, how far it may bend edges."""

from __future__ import annotations

import numpy as np

from robocal._jit import as_kernel_array
from robocal._types import Array
from robocal.vision._kernels import ideal_pixels

__all__ = ["COMMON_LENS", "OTHER_LENS", "bend_of", "ideal_points", "without_distortion"]

OTHER_LENS = (
    0.35  # tolerance: of the bend by a common lens: what its own step and another lens add to it in any direction
)
THIN = 7  # grid: of the pixels one in so many tells how a lens bends them
COMMON_LENS = (0.8, -0.25)  # focal length in image widths, k1: a webcam's


def without_distortion(box: tuple[int, int, int, int], lens: Array | None) -> tuple[Array, Array]:
    """Where the pixels (m, 2) of a box would lie without distortion, and the derivatives (m, 4) by the pixel."""
    u0, v0, width, height = box
    ideal, slope = np.empty((width * height, 2)), np.empty((width * height, 4))
    if lens is None:
        v, u = np.divmod(np.arange(width * height), width)
        ideal[:, 0], ideal[:, 1] = u0 + u, v0 + v
        slope[:] = (1.0, 0.0, 0.0, 1.0)
    else:
        ideal_pixels(float(u0), float(v0), width, as_kernel_array(lens), ideal, slope)
    return ideal, slope


def ideal_points(points: Array, lens: Array) -> Array:
    """Points (k, 2) of an image where they would lie without distortion."""
    out, slope = np.empty((len(points), 2)), np.empty((1, 4))
    for i, (u, v) in enumerate(points):
        ideal_pixels(float(u), float(v), 1, as_kernel_array(lens), out[i : i + 1], slope)
    return out


def bend_of(at: Array, found: Array, shape: tuple[int, ...]) -> tuple[Array, Array]:
    """By how much a common lens, not known, would move pixels (m, 2) and corners (k, 2), less the affine part (px)."""
    middle, focal = (np.array(shape[::-1]) - 1) / 2, COMMON_LENS[0] * shape[1]

    def moved(points: Array) -> Array:
        off = (points - middle) / focal
        return np.asarray(COMMON_LENS[1] * focal * (off**2).sum(axis=1)[:, None] * off)

    design, there = (np.column_stack([np.ones(len(q)), q - middle]) for q in (at, found))
    bent, some = moved(at), slice(None, None, THIN)
    fit = np.linalg.lstsq(design[some], bent[some])[0]
    return bent - design @ fit, moved(found) - there @ fit
