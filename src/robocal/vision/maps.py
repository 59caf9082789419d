"""Maps of markers: where square markers are to one another, with what all of that may be off by."""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.errors import require
from robocal.geometry import se3
from robocal.vision.sheets import SQUARE

__all__ = ["MapLens", "MarkerMap"]


@record(eq=False)
class MapLens:
    """The lens of the images that a map was made from: its model, its numbers as given `before` and as found `after` the fit, the
    covariance (k, k) of those that were `known`, as found, and that of the small motions of all markers (6M, k), and of their edges
    (M, k) or None, with these.

    The error that the given numbers had shares as much with the map as that of the found ones: with a prior of covariance P and a result
    of covariance C, errors of the result are e = C (J^T R^-1 noise + P^-1 e_0), so that E[e e_0^T] = C.
    """

    model: str
    known: tuple[str, ...]
    before: tuple[float, ...]
    after: tuple[float, ...]
    covariance: Array
    across: Array
    edges: Array | None = None


@record(eq=False)
class MarkerMap:
    """Names (M) of markers, the edges of their black squares (M,) in m, their poses T_map_marker as frame vectors (M, 6), and the
    covariance (6M, 6M) of the small motions (v, w) of each in map axes, p <- p + v and R <- exp(w) R, or None where nobody states it.

    Where sizes were found beside the places, `size_covariance` (M, 7M) is that of each edge with the small motions of all markers, and
    behind these with all edges, m and rad; `size_errors` is what the edges that were told could be off by: all alike (m), and each (of
    itself). Every map of these prints has that error in common. `lens` is what the map
    shares with the lens of its images, where it says so.

    A map is known but for where it is as a whole: its covariance is the one in which no motion of all markers together is counted. z of
    a marker points out of its printed side, corners are counted from the top left: 0 (-, +), 1 (+, +), 2 (+, -), 3 (-, -).
    """

    names: tuple[str, ...]
    size: Array
    vector: Array
    covariance: Array | None = None
    family: str | None = None
    source: str = ""
    size_covariance: Array | None = None
    size_errors: tuple[float, float] | None = None
    lens: MapLens | None = None

    def __post_init__(self) -> None:
        count = len(self.names)
        require(len(set(self.names)) == count, "a map names a marker twice", found=str(self.names), expected="one each")
        require(self.size.shape == (count,), "other sizes than markers", found=self.size.shape, expected=str((count,)))
        require(
            self.vector.shape == (count, 6),
            "other poses than markers",
            found=self.vector.shape,
            expected=str((count, 6)),
        )

    @property
    def poses(self) -> Array:
        """T_map_marker (M, 4, 4)."""
        return se3.from_vector(self.vector)

    @property
    def joint(self) -> Array | None:
        """The covariance of the small motions (6M), behind them of the edges (M), where sizes were found, and of the numbers of the lens
        (k), where the map says what it shares with these."""
        out = self.covariance
        if out is not None and self.size_covariance is not None:
            across = self.size_covariance[:, : len(out)]
            out = np.block([[out, across.T], [self.size_covariance]])
        if out is None or self.lens is None:
            return out
        beside = self.lens.across if self.lens.edges is None else np.vstack([self.lens.across, self.lens.edges])
        return np.block([[out, beside], [beside.T, self.lens.covariance]])

    @property
    def corners(self) -> Array:
        """Corners (M, 4, 3) in map axes, m."""
        own = SQUARE * (self.size / 2)[:, None, None]
        poses = self.poses
        return np.asarray(np.einsum("mij,mkj->mki", poses[:, :3, :3], own) + poses[:, None, :3, 3])
