"""Frame anchors from ranges between beacons that stand on the winches.

    minimise sum (|a_i - a_j| - r_ij)^2 / sigma^2        by Gauss and Newton, from a rough sketch

Ranges say nothing of where the whole is: the frame is that of three beacons. The first stays where the sketch has it, the second in its
direction from the first, the third in the plane of the three. Of sketches along the axes these are six coordinates that no number moves.
Source: seed document, 3.4.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Bools
from robocal.errors import ModelError, require
from robocal.geometry import fits

__all__ = ["anchors_of_ranges", "gauge_of", "into_gauge"]

ITERATIONS = 100
ENOUGH = 1e-12  # tolerance: m, of a step
LEVEL = 1e-9  # tolerance: m, of coordinates of a sketch that are the same


def gauge_of(sketch: Array) -> Bools:
    """Which coordinates (m, 3) of anchors the frame of the first three fixes. Raises ModelError where they do not lie along axes."""
    held = np.zeros(sketch.shape, dtype=bool)
    held[0] = True
    along, across = np.abs(sketch[1] - sketch[0]), np.abs(sketch[2] - sketch[0])
    first = int(np.argmax(along))
    rest = [i for i in range(3) if i != first]
    flat = min(rest, key=lambda i: float(across[i]))
    good = bool((along[rest] < LEVEL).all()) and across[flat] < LEVEL < along[first]
    expected = "the second anchor along an axis from the first, the third in a plane of two axes"
    require(good, "three anchors that fix no frame", key="frame_anchors", found=sketch[:3].tolist(), expected=expected)
    held[1, rest] = True
    held[2, flat] = True
    return held


def into_gauge(anchors: Array, sketch: Array) -> Array:
    """The motion (4, 4) that carries anchors (m, 3) into the frame of the first three of a sketch."""

    def frame(points: Array) -> Array:
        x = points[1] - points[0]
        z = np.cross(x, points[2] - points[0])
        x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
        return np.asarray(points[0] + np.stack([np.zeros(3), x, np.cross(z, x), z]))

    return fits.rigid(frame(anchors), frame(sketch))


def anchors_of_ranges(ranges: Array, sketch: Array, sigma: float) -> tuple[Array, Array]:
    """Anchors (m, 3) in m and the covariance (3 m, 3 m) of their coordinates, zero where the frame fixes them.

    ranges (m, m) in m, of which those above the diagonal are read, not a number where there is none; sketch (m, 3) in m: about where they
    are; sigma of a range in m. Raises ModelError for too few ranges, and where they leave a beacon open.
    """
    free = ~gauge_of(sketch)
    one, other = np.nonzero(np.triu(np.isfinite(ranges), 1))
    count, expected = int(free.sum()), f"at least {int(free.sum())}"
    require(len(one) >= count, "too few ranges", found=len(one), expected=expected)
    require(sigma > 0, "a noise is a standard deviation", key="sigma", found=sigma, expected="above 0")
    a = sketch.astype(float).copy()
    for _ in range(ITERATIONS):
        way = a[one] - a[other]
        length = np.linalg.norm(way, axis=1)
        slope = np.zeros((len(one), *a.shape))
        rows = np.arange(len(one))
        slope[rows, one], slope[rows, other] = way / length[:, None], -way / length[:, None]
        slope = slope[:, free]
        step, _, rank, _ = np.linalg.lstsq(slope, ranges[one, other] - length, rcond=None)
        if rank < count:
            raise ModelError("these ranges leave a beacon open", found=f"rank {rank}", expected=f"{count}")
        a[free] += step
        if np.abs(step).max() < ENOUGH:
            break
    covariance = np.zeros((a.size, a.size))
    at = np.flatnonzero(free)
    covariance[np.ix_(at, at)] = sigma**2 * np.linalg.inv(slope.T @ slope)
    return a, covariance
