"""What images show of a target: points with their covariance, which markers are seen together, and how much of the image they cover."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import record
from robocal._types import Array, Bools, Ints
from robocal.vision.marker.edges import fit_edges
from robocal.vision.marker.fit import SQUARE, fit_marker, homography

__all__ = [
    "BOARD",
    "METHODS",
    "Sighting",
    "coverage_of",
    "find_islands",
    "fit_sighting",
    "reaches_border",
    "share_of_white",
]

BOARD = -1  # the number of what has none
METHODS = ("all pixels", "four edges", "crossing")
MISFIT = 0.3  # noise of a pixel, of the contrast: what the dictionary says is not what is seen there
FAINT = 8.0  # grey levels of contrast
ASTRAY = 0.15, 3.0  # of a side, or px, whichever is more: that a fit may move from where the search was
WHITE = 250.0  # grey levels: brighter ones may be cut off
GRID = 8, 6  # parts of an image, for its coverage


@record(eq=False)
class Sighting:
    """One marker, or one board (number -1), in one view: corners by number (k,), where they are (k, 2), their covariance (2 k, 2 k), blur
    in pixels, noise of one pixel and contrast in grey levels, and how the corners were fitted (one of METHODS)."""

    marker: int
    corner: Ints
    place: Array
    covariance: Array
    blur: float
    noise: float
    contrast: float
    method: str
    cut: bool = False  # its quiet zone ends at the border of the image
    off: tuple[float, float] = (0.0, 0.0)  # cells, of what is in the square
    white: float = 0.0  # share of its bright cells that may be cut off

    @property
    def sigma(self) -> Array:
        """Standard deviations (k, 2)."""
        return np.sqrt(np.diag(self.covariance)).reshape(-1, 2)


def fit_sighting(
    levels: Array, marker: int, corners: Array, cells: Array, lens: Array | None = None
) -> Sighting | None:
    """A marker near corners (4, 2) that a search has found, from all its pixels, else from its edges; None where neither shows it.
    lens: as in `fit_marker`."""
    side = float(np.hypot(*(np.roll(corners, -1, axis=0) - corners).T).max())
    allowed = max(ASTRAY[0] * side, ASTRAY[1])
    beyond = reaches_border(corners, len(cells), levels.shape)
    white = share_of_white(levels, corners)
    order = np.arange(4)
    found = fit_marker(levels, corners, cells, lens)
    if found is not None:
        contrast, near = found.light[3], np.abs(found.corners - corners).max() < allowed
        if near and contrast > FAINT and found.noise < MISFIT * contrast:
            of = (
                found.blur,
                found.noise,
                float(contrast),
                METHODS[0],
                beyond,
                (float(found.off[0]), float(found.off[1])),
                white,
            )
            return Sighting(marker, order, found.corners, found.covariance, *of)
    edges = fit_edges(levels, corners)
    if edges is None or np.abs(edges[0] - corners).max() > allowed:
        return None
    return Sighting(marker, order, *edges, np.nan, np.nan, np.nan, METHODS[1], beyond, white=white)


def reaches_border(corners: Array, cells: int, shape: tuple[int, ...]) -> bool:
    """Whether a marker's quiet zone of one cell ends at the border of an image (h, w)."""
    h = homography(SQUARE, corners)
    x, y = (SQUARE * (1 + 2 / cells)).T
    w = h[6] * x + h[7] * y + 1
    u, v = (h[0] * x + h[1] * y + h[2]) / w, (h[3] * x + h[4] * y + h[5]) / w
    return bool((w <= 0).any() or min(u.min(), v.min()) < 0 or u.max() > shape[1] - 1 or v.max() > shape[0] - 1)


def share_of_white(levels: Array, corners: Array) -> float:
    """The share of bright pixels around a marker that are so bright that they may be cut off."""
    low = np.maximum(np.floor(corners.min(axis=0)), 0).astype(int)
    high = np.ceil(corners.max(axis=0)).astype(int) + 1
    box = levels[low[1] : high[1], low[0] : high[0]]
    bright = box > 0.5 * (float(box.min()) + float(box.max()))
    return float((box[bright] >= WHITE).mean()) if bright.any() else 0.0


def find_islands(seen: Bools) -> list[Ints]:
    """Markers by the views that join them, from which view sees which (views, markers): each island's markers, the largest first."""
    left, islands = seen.any(axis=0), []
    while left.any():
        island = np.zeros(seen.shape[1], dtype=bool)
        island[np.argmax(left)] = True
        while True:
            grown = seen[seen[:, island].any(axis=1)].any(axis=0) | island
            if (grown == island).all():
                break
            island = grown
        islands.append(np.flatnonzero(island))
        left &= ~island
    return sorted(islands, key=lambda i: -len(i))


def coverage_of(places: Sequence[Array], width: int, height: int) -> float:
    """The share of the parts of an image, GRID, in which some view has a corner."""
    flat = np.concatenate([np.empty((0, 2)), *(p.reshape(-1, 2) for p in places)])
    at = np.clip(flat / [width, height] * GRID, 0, np.array(GRID) - 1).astype(int)
    return len(np.unique(at[:, 0] * GRID[1] + at[:, 1])) / (GRID[0] * GRID[1])
