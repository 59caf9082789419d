"""Pixels that show something else than the marker, and what the others leave beyond noise."""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.vision.marker._kernels import CUT

__all__ = ["around", "foreign_pixels", "glare_pixels", "parts_of", "pull_of_parts", "shares_parts"]

# tolerance: of the contrast, and of noise: a pixel that is off by more shows something else, as glare, and so may its neighbours
FOREIGN, RIM = (0.5, 6.0), 3  # px
MEDIAN = 1.4826  # the standard deviation of noise by its median
WHITE = 230.0  # tolerance: grey levels: where a marker's white is darker, a pixel that is cut off shows glare
PARTS = 8  # grid: along a box, whose pixels may be off together; and half as many, and a quarter
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


def parts_of(number: Ints, width: int) -> Ints:
    """The part in which each pixel lies, of those of a box of `width` by their numbers (k,)."""
    row, column = np.divmod(number, width)
    low, left = row.min(), column.min()
    part: Ints = (row - low) * PARTS // (row[-1] - low + 1) * PARTS + (column - left) * PARTS // (
        column.max() - left + 1
    )
    return part


def shares_parts(number: Ints, rest: Array, width: int, limit: float) -> bool:
    """Whether misfits (k,) are off together, part by part: the light is not that of the model."""
    part, cut = parts_of(number, width), np.clip(rest, -limit, limit)
    count, total = np.bincount(part), np.bincount(part, cut)
    some = count > 0
    return bool(np.mean(total[some] ** 2 / count[some]) > TOGETHER * np.mean(cut**2))


def pull_of_parts(pull: Array, own: Array, by: Array, inverse: Array) -> float:
    """The variance of a pixel that explains how far parts move numbers, whose derivatives by the parameters are `by` (m, n), through the
    inverse (n, n) of all normal matrices; of parts the gradients (PARTS^2, n) and normal matrices. The largest for parts, fours, and so on:

        sum_k |B g_k|^2 = s^2 sum_k tr(B (A_k - A_k A^-1 A_k) B'),    the second term is what the fit has taken."""
    most, count = 0.0, PARTS
    while count > 1:
        through = by @ own
        usual = np.sum(through * by) - np.sum((through @ inverse) * through)
        most = max(most, float(np.sum((pull @ by.T) ** 2) / usual))
        count //= 2
        pull, own = (_four(v, count).sum(axis=1) for v in (pull, own))
    return most


def _four(values: Array, count: int) -> Array:
    """Values (4 count^2, ...) of parts as (count^2, 4, ...)."""
    shape = values.shape[1:]
    return np.asarray(values.reshape(count, 2, count, 2, *shape).swapaxes(1, 2).reshape(count**2, 4, *shape))
