"""Whether the blur of a marker is wider along one direction than across it: a camera or a target that moved."""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Bools
from robocal.vision.marker.fit import SQUARE, homography

__all__ = ["blur_of_motion"]

SAMPLES = 4  # a pixel, along each side
RIM = 3  # px
NARROW, WIDE = 0.3, 8.0  # px, of a blur
ROUNDS = 3
FEWEST = 100  # pixels
FLAT = 1.0  # grey levels of contrast
LARGEST = 300  # px: larger markers are looked at in a part


def blur_of_motion(
    levels: Array, corners: Array, cells: Array, blur: float, off: tuple[float, float] = (0.0, 0.0), white: bool = True
) -> Array:
    """By how much (2, 2), in px^2, the variance of the blur of a marker differs from that of its isotropic fit; off:
    cells, as in `Sighting`; white: whether that is around it. Cells may be the other way round where it is not.

    The derivative of a blurred image by the variance along u is half its second derivative: what is left of the image is divided among
    those along u, v and between them, beside brightness and contrast (least squares).
    """
    low = np.maximum(np.floor(corners.min(axis=0)) - RIM, 0).astype(int)
    high = np.minimum(np.ceil(corners.max(axis=0)) + RIM + 1, np.array(levels.shape[::-1])).astype(int)
    high = np.minimum(high, low + LARGEST)
    seen = np.asarray(levels[low[1] : high[1], low[0] : high[0]], dtype=float)
    offsets = (np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5
    u = (np.arange(low[0], high[0])[:, None] + offsets).ravel()
    v = (np.arange(low[1], high[1])[:, None] + offsets).ravel()
    inverse = np.linalg.inv(np.append(homography(SQUARE, corners), 1.0).reshape(3, 3))
    n = len(cells)
    w = inverse[2, 0] * u + (inverse[2, 1] * v + inverse[2, 2])[:, None]
    x = (inverse[0, 0] * u + (inverse[0, 1] * v + inverse[0, 2])[:, None]) / w
    y = (inverse[1, 0] * u + (inverse[1, 1] * v + inverse[1, 2])[:, None]) / w
    column, row = (np.clip(np.floor((c + 1) * n / 2 - d).astype(int), 0, n - 1) for c, d in ((x, off[0]), (y, off[1])))
    reach = 1 + 2 / n if white else 1 - 1 / n
    inside = (np.abs(x) < reach) & (np.abs(y) < reach)
    shade = np.where((np.abs(x) < 1) & (np.abs(y) < 1), cells[row, column], 1.0)
    shape = (len(seen), SAMPLES, seen.shape[1], SAMPLES)
    ideal, shown = shade.reshape(shape).mean(axis=(1, 3)), inside.reshape(shape).all(axis=(1, 3))
    used = shown.copy()
    used[:RIM] = used[-RIM:] = used[:, :RIM] = used[:, -RIM:] = False
    isotropic = max(blur, NARROW) ** 2 * np.eye(2)
    spread = isotropic
    if used.sum() < FEWEST:
        return np.zeros((2, 2))
    for _ in range(ROUNDS):
        spread = _bound(spread + _change(_blur(ideal, spread), seen, used))
    return spread - isotropic


def _change(smooth: Array, seen: Array, used: Bools) -> Array:
    """The change (2, 2) of the variances that brings a blurred print nearest to the image."""
    by_v, by_u = np.gradient(smooth)
    vv, uv = np.gradient(by_v)
    uu = np.gradient(by_u, axis=1)
    grid_v, grid_u = np.indices(seen.shape) / max(seen.shape)
    light = [np.ones_like(seen), grid_u, grid_v]
    # A lens bends edges, and white grows: both leave traces at edges that are no blur.
    bends = [d * f for d in (by_u, by_v) for f in (1.0, grid_u, grid_v, grid_u**2, grid_u * grid_v, grid_v**2)]
    terms = [smooth, uu / 2, uv, vv / 2, smooth * grid_u, smooth * grid_v, *light, *bends, np.hypot(by_u, by_v)]
    found = np.linalg.lstsq(np.stack([t[used] for t in terms], axis=1), seen[used], rcond=None)[0]
    a, b, c = found[1:4] / found[0] if abs(found[0]) > FLAT else np.zeros(3)
    return np.array([[a, b], [b, c]])


def _bound(spread: Array) -> Array:
    """Variances that are those of some blur."""
    widths, along = np.linalg.eigh(spread)
    return np.asarray(along * np.clip(widths, NARROW**2, WIDE**2) @ along.T)


def _blur(image: Array, spread: Array) -> Array:
    """An image blurred by a normal law with these variances (2, 2), by its Fourier transform."""
    reach = int(np.ceil(4 * np.sqrt(np.trace(spread))))
    wide = np.pad(image, reach, mode="edge")
    u, v = np.fft.rfftfreq(wide.shape[1]), np.fft.fftfreq(wide.shape[0])[:, None]
    power = spread[0, 0] * u**2 + 2 * spread[0, 1] * u * v + spread[1, 1] * v**2
    out = np.fft.irfft2(np.fft.rfft2(wide) * np.exp(-2 * np.pi**2 * power), wide.shape)
    return np.asarray(out[reach : reach + image.shape[0], reach : reach + image.shape[1]])
