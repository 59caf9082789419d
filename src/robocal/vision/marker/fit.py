"""One marker: its four corners from all its pixels, with their covariance."""

from __future__ import annotations

import numpy as np

from robocal._jit import as_kernel_array
from robocal._record import record
from robocal._types import Array
from robocal.vision.marker._kernels import BLUR, LIGHT, SHIFT, SIZE, choose, fit_pixels

__all__ = ["SQUARE", "MarkerFit", "fit_marker"]

# Corners in the order of detectors: top left, top right, bottom right, bottom left; Y down, as in the image.
SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
QUIET = 1.0  # cells of quiet zone that are used, at most
CLEAR = 2.5  # blur widths that stay away from its rim
FIRST_BLUR = 1.2  # px
QUANTUM = 0.3  # grey levels, of one step of the camera's numbers
COARSE = 600  # pixels that the first look takes
STILL = 3e-3  # px
ROUNDS = 12


@record(eq=False)
class MarkerFit:
    """Corners (4, 2) in pixels, their covariance (8, 8), blur and edge shift (px; white grows), light (6,) in grey levels, noise in grey
    levels (one pixel), and how many pixels were used."""

    corners: Array
    covariance: Array
    blur: float
    shift: float
    light: Array
    noise: float
    pixels: int


def fit_marker(image: Array, corners: Array, cells: Array) -> MarkerFit | None:
    """A marker of cells (n, n), 1 white and 0 black, near corners (4, 2) of a grey image (h, w); None where its pixels do not tell."""
    h, w = image.shape
    reach = 3.0 + 1.5 * np.ptp(corners, axis=0).max() / len(cells)
    low = np.clip(np.floor(corners.min(axis=0) - reach), 0, (w - 1, h - 1)).astype(int)
    high = np.clip(np.ceil(corners.max(axis=0) + reach) + 1, 1, (w, h)).astype(int)
    v, u = np.mgrid[low[1] : high[1], low[0] : high[0]]
    ideal = as_kernel_array(np.stack([u.ravel(), v.ravel()], axis=1))
    slope = np.tile([1.0, 0.0, 0.0, 1.0], (len(ideal), 1))
    grey = as_kernel_array(image[low[1] : high[1], low[0] : high[0]].ravel())
    ink = as_kernel_array(cells - 1.0)
    joints = np.diff(np.diff(np.pad(ink, 1), axis=0), axis=1)
    joints = as_kernel_array(joints)
    quiet = 2 * QUIET / len(cells)
    p, a = np.zeros(SIZE), np.zeros((SIZE, SIZE))
    p[:8] = homography(SQUARE, corners)
    p[BLUR] = 0.8
    inside = np.empty(len(ideal), dtype=bool)
    limit, noise, before = np.inf, 0.0, np.full(8, np.inf)
    for step in range(ROUNDS):
        count = choose(ideal, slope, p, p[BLUR] if step else FIRST_BLUR, quiet, CLEAR, inside)
        if count < 2 * SIZE:
            return None
        thin = max(count // COARSE, 1) if step == 0 else 1
        seen, at, by = (part[inside][::thin] for part in (grey, ideal, slope))
        if step == 0:
            dark, bright = np.percentile(seen, [10, 90])
            p[LIGHT], p[LIGHT + 3] = dark, bright - dark
            limit = 0.3 * (bright - dark)
        before = corners_of(p[:8])[0]
        cost = fit_pixels(seen, at, by, p, ink, joints, limit, ROUNDS, STILL if step else 0.05, a)
        if not cost >= 0.0:
            return None
        noise = float(np.sqrt(2 * cost / (len(seen) - SIZE)))
        limit = 3 * max(noise, QUANTUM)
        if step > 0 and np.abs(corners_of(p[:8])[0] - before).max() < 0.1:
            break
    a = np.tril(a) + np.tril(a, -1).T
    try:
        spread = noise**2 * np.linalg.inv(a)[:8, :8]
    except np.linalg.LinAlgError:
        return None
    found, by = corners_of(p[:8])
    return MarkerFit(found, by @ spread @ by.T, float(p[BLUR]), float(p[SHIFT]), p[LIGHT:].copy(), noise, int(count))


def corners_of(h: Array) -> tuple[Array, Array]:
    """Corners (4, 2) of a homography (8,), and their derivatives (8, 8)."""
    x, y = SQUARE.T
    w = 1 / (h[6] * x + h[7] * y + 1)
    u, v = (h[0] * x + h[1] * y + h[2]) * w, (h[3] * x + h[4] * y + h[5]) * w
    by = np.zeros((4, 2, 8))
    for i, f in enumerate((x, y, np.ones(4))):
        by[:, 0, i] = by[:, 1, 3 + i] = f * w
    for i, f in ((6, x), (7, y)):
        by[:, 0, i], by[:, 1, i] = -u * f * w, -v * f * w
    return np.stack([u, v], axis=1), by.reshape(8, 8)


def homography(points: Array, image: Array) -> Array:
    """The eight numbers that take four points (4, 2) to the image (4, 2)."""
    x, y = points.T
    u, v = image.T
    one, none = np.ones(4), np.zeros((4, 3))
    first = np.column_stack([x, y, one, none, -u * x, -u * y])
    second = np.column_stack([none, x, y, one, -v * x, -v * y])
    return np.linalg.solve(np.vstack([first, second]), np.concatenate([u, v]))
