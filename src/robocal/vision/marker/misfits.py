"""Pixels that show something else than the marker, and what the others leave beyond noise."""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.vision.marker._kernels import CUT

__all__ = ["around", "foreign_pixels", "glare_pixels", "parts_of", "shares_parts"]

# tolerance: of the contrast, and of noise: a pixel that is off by more shows something else, as glare, and so may its neighbours
FOREIGN, RIM = (0.5, 6.0), 3  # px
MEDIAN = 1.4826  # the standard deviation of noise by its median
WHITE = 230.0  # tolerance: grey levels: where a marker's white is darker, a pixel that is cut off shows glare
PARTS = (2, 3, 4, 6, 8)  # grid: parts along a box, whose pixels may be off together
# tolerance: of a part's squared sum by that of its pixels: 0.6 to 1.4 in 400 drawn markers, 15 and more under a soft light
TOGETHER = 3.0


def glare_pixels(grey: Array, bright: float, width: int) -> Bools:
    """The pixels (m,) of a box that glare and its rim cover, beside a marker whose white is `bright`."""
    return around(grey >= CUT, width) if bright < WHITE and (grey >= CUT).any() else np.zeros(len(grey), dtype=bool)


def foreign_pixels(rest: Array, noise: float, contrast: float) -> Bools:
    """Which misfits (k,) are more than noise and blur leave. What is foreign raises the noise that a cost tells; not the median."""
    usual = min(noise, MEDIAN * float(np.median(np.abs(rest))))
    return np.asarray(np.abs(rest) > max(FOREIGN[0] * abs(contrast), FOREIGN[1] * usual))


def around(pixels: Bools, width: int) -> Bools:
    """The pixels (m,) of a box of `width` near some of them."""
    out = pixels.reshape(-1, width)
    for _ in range(RIM):
        wide = np.pad(out, 1)
        out = wide[1:-1, 1:-1] | wide[:-2, 1:-1] | wide[2:, 1:-1] | wide[1:-1, :-2] | wide[1:-1, 2:]
    return out.ravel()


def parts_of(inside: Bools, width: int, count: int) -> Ints:
    """The part, of count x count, in which each pixel (k,) of a box lies, of those inside."""
    row, column = np.divmod(np.flatnonzero(inside), width)
    low, left = row.min(), column.min()
    part: Ints = (row - low) * count // (row.max() - low + 1) * count + (column - left) * count // (
        column.max() - left + 1
    )
    return part


def shares_parts(inside: Bools, rest: Array, width: int, limit: float) -> bool:
    """Whether misfits (k,) of the pixels inside are off together, part by part: the light is not that of the model."""
    part, cut = parts_of(inside, width, PARTS[-1]), np.clip(rest, -limit, limit)
    count, total = np.bincount(part), np.bincount(part, cut)
    some = count > 0
    return bool(np.mean(total[some] ** 2 / count[some]) > TOGETHER * np.mean(cut**2))
